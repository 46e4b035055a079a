"""All subjects, by name."""

import epidemic
import oscillator
import rod
import stand_in

SUBJECTS = {one.SUBJECT.name: one.SUBJECT for one in (epidemic, oscillator, rod, stand_in)}
