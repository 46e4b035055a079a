"""Notices are logged, and the command line prints them."""

import logging

from bolfi_liquids.cli.errors import PACKAGE, print_notices


def test_notices_are_printed_once_however_often_it_is_asked(capsys):
    print_notices()
    print_notices()
    logging.getLogger(f"{PACKAGE}.calibration").warning("%s: removed", "runs/mine")
    logging.getLogger(f"{PACKAGE}.calibration").debug("not for everybody")
    assert capsys.readouterr().err == "runs/mine: removed\n"
