"""The error that a person's input causes."""

import pickle

from bolfi_liquids.errors import InputError


def test_it_says_the_same_in_another_process():
    error = InputError("viscosity -1 is negative", where="stir.nc", fix="give one in Pa s")
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) == "stir.nc: viscosity -1 is negative; give one in Pa s"
    assert (again.what, again.where, again.fix) == (error.what, error.where, error.fix)
