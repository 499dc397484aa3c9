"""What the codes of faults and warnings mean, in one sentence each; docs/faults.md lists them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from sprag_study.service.faults import Code, Kind, WarningCode

#: Of faults of one place.
MEANINGS: Final[dict[Code, str]] = {
    "ambiguous": "It fits several names or ids.",
    "cannot-assemble": "The mechanism cannot be assembled at some angle.",
    "circular": "Derived parameters need each other's values.",
    "conflict": "Fields contradict each other.",
    "empty": "Nothing is left, or nothing was given, where there must be something.",
    "exactly-one": "Exactly one of several fields must be given.",
    "inertia-insufficient": "The shaft would stop, or nearly stop, within the cycle.",
    "invalid-choice": "The value is not one of the choices.",
    "invalid-formula": "The formula cannot be read, or its value is not a number.",
    "invalid-machine": "The named parts do not form a machine, or a name in its formulas is invalid.",
    "invalid-path": "The path does not name a number that can vary.",
    "invalid-range": "The ends, the step or the count of a range contradict each other.",
    "invalid-table": "A table is too short, not ascending, or not closed over the cycle.",
    "invalid-text": "The text does not have the required form.",
    "invalid-time": "The text is not a time, or the time never occurs.",
    "missing-unit": "A text needs a unit.",
    "motor-overrun": "The load drives the shaft harder than the motor can brake it.",
    "motor-stalled": "The load stalls the motor, or holds it at a speed at which its torque jumps.",
    "near-singular": "The mechanism passes too close to a singular position.",
    "negative-inertia": "The reduced inertia is not positive at every angle.",
    "no-clutch-law": "The coefficients are not a clutch law, or no law fits the measured data.",
    "not-a-grid": "The axes vary together, and a grid is required.",
    "ambiguous-comma": (
        "The comma could be decimal or separate: `1,234` could be 1.234 or 1234, and in a list separated by "
        "commas `0,5` could be 0.5, or 0 and 5. Write a decimal point, or semicolons between values."
    ),
    "ambiguous-point": (
        "No number of the table shows what its points are: `20.000` could be 20 or 20000. Write numbers without "
        "separators of thousands, one of them with another number of decimals than three."
    ),
    "ambiguous-unit": (
        "A number without a unit stands beside quantities in another unit, and could be in either: `50` beside "
        "`100 N*mm` could be 50 N*m or 50 N*mm. Write its unit."
    ),
    "not-a-number": "The text does not begin with a number.",
    "not-an-axis": "The path is not an axis of the study.",
    "not-finite": "The number is not finite.",
    "not-fixed": "An axis needs one value and has none.",
    "not-numeric": "The result is a category, and a number is required.",
    "not-used": "The field has no effect here and is therefore refused.",
    "nothing-in-common": "The compared studies have no varying parameter, or no result, in common.",
    "nothing-varies": "The study has one case only, or no axis.",
    "out-of-range": "The value is outside the allowed range.",
    "quadrature-not-reached": "Torque or inertia is too rough to be integrated to the required accuracy.",
    "repeated": "The same field, value or case is given more than once.",
    "required": "A required field is missing.",
    "too-long": "The text is too long.",
    "too-many": "There are more values, cases or parameters than allowed.",
    "too-many-faults": "There are more faults than are listed.",
    "unbalanced-work": "Drive and resistance do not do opposite work over the cycle.",
    "unequal-lengths": "Lists that go together have different lengths.",
    "unknown-field": "There is no field or parameter of this name.",
    "unknown-name": "There is no item of this name or number.",
    "unknown-value": "The axis does not have this value.",
    "unreadable": "The document cannot be read: its size, encoding or syntax.",
    "unsupported-version": "This version of the spec is not supported.",
    "wrong-type": "The value has the wrong type: an object, a list, a text, a number or true or false is required.",
    "wrong-unit": "The unit cannot be read, or it is a unit of another quantity.",
}

#: Kinds that are not HTTP problem types.
KIND_MEANINGS: Final[dict[Kind, str]] = {
    "database-busy": "Another process locked the database for too long.",
    "database-damaged": "The database is damaged.",
    "database-forbidden": "The user lacks the rights for this in the database.",
    "database-in-use": "Another process works on a database that is to be moved or upgraded, or uses it otherwise.",
    "database-read-only": "The database, or its folder, is read-only.",
    "database-replaced": "The file of the database was deleted, moved or replaced while it was in use.",
    "database-unreachable": "The database cannot be reached or opened.",
    "file-exists": "The file exists already and is not replaced.",
    "invalid-data": "The measured data cannot be read, or no clutch law fits them.",
    "invalid-database-url": "The URL does not name a database.",
    "invalid-file": "The file cannot be read.",
    "invalid-settings": "A setting is not valid.",
    "missing-extra": "A package is not installed; the message names the extra that installs it.",
    "move-differs": "A moved row is not the same in both databases; the move is run again.",
    "not-a-database": "The file or database is not one of Sprag.",
    "not-done": "The study was not finished.",
    "target-not-empty": "The target of a move has rows already, or an unfinished move of another database.",
    "unknown-tables": "The database has tables of another program, which are not moved.",
    "unreachable": "No service answered at this address.",
    "unsupported-database": "This kind, version or place of a database is not supported.",
    "write-failed": "The output cannot be written.",
    "wrong-revision": "The database has another revision than this program; the message names the command to run.",
}

#: Of warnings.
WARNING_MEANINGS: Final[dict[WarningCode, str]] = {
    "added-vibration": "The base has a measured motion and an amplitude, which is added to it.",
    "ambiguous-point": "Points are read as decimal points, though each of them could separate thousands.",
    "angular-frequency": "A formula gives a frequency by a root without a factor pi, which is an angular frequency.",
    "assumed-units": "The file of measured data does not name every unit.",
    "exceeds-chunk-timeout": "One case takes longer than `SPRAG_CHUNK_TIMEOUT` allows.",
    "falls-over": "The spring does not hold the pendulum up against gravity.",
    "implausible-value": "The value is far outside what machines of this kind have; probably it is in another unit.",
    "impossible-inertia": "The inertia is less than that of the mass at its arm alone.",
    "invalid-drives": "Tolerances give some drives a derived parameter out of its range; these drives fail.",
    "late": "By estimate the study will not be finished by its deadline.",
    "law-ends-falling": (
        "The clutch law has a negative slope at the end of its range, and its straight continuation falls to zero."
    ),
    "law-falls": "The torque of the clutch law falls with growing windup somewhere.",
    "law-jumps": "c_1 > 0: the torque jumps as soon as contact begins.",
    "many-runs": "Cases times starts of each are more than a million runs.",
    "mixed-origins": "The cases of the study were not all computed by one version of Sprag and its libraries.",
    "near-resonance": (
        "A harmonic of the cycle is within 5 % of a torsional natural frequency of the train, with the dynamic factor "
        "that results."
    ),
    "never-acts": "A step over the stroke begins after its end and never acts.",
    "no-compression": "The discharge pressure is below the suction pressure.",
    "no-discharge": "The compressor does not reach the discharge pressure.",
    "no-effect": "The value, or the axis, changes no result.",
    "no-such-angle": "No angle with T = T_mean has the number that was chosen.",
    "not-monotonic": "The values of a list neither rise nor fall throughout.",
    "nothing-acts": "The machine, or one of its parts, has neither a mechanism nor an operation.",
    "nothing-moves": "Both amplitudes of the base are 0.",
    "reduced-motion": (
        "Harmonics stand for the measured motion of the base. The warning says what they leave of it, in percent of "
        "its amplitude."
    ),
    "replaced-value": "The value is replaced, as another field requires.",
    "rows-in-backlash": "Some measured rows lie within the backlash and were left out of the fit.",
    "several-speeds": "The shaft may turn steadily at more speeds than the one that the results are about.",
    "short-search": "The search for a settled motion is too short for the means of irregular motion.",
    "short-window": "The window is shorter than one excitation period.",
    "slow-excitation": "The excitation is slow for a vibration drive.",
    "stays-upright": "A pendulum that starts upright without speed stays there under vibration along y alone.",
    "table-ends-early": (
        "A table ends long before its cycle; over the rest its value goes from the last row back to the first."
    ),
    "terms-cancel": "The terms of the fitted law nearly cancel and follow the scatter of the data.",
    "tolerance-cut": "Part of the distribution of a tolerance lies outside the range of its parameter and is left out.",
    "too-few-rows": "The fit has as many unknowns as the data has different windups.",
    "torque-reverses": "The torque of a coupling changes its sign within the cycle; backlash would matter there.",
    "unstable-motion": "The steady motion of the machine is unstable: its shaft runs away from it, or stops.",
    "wide-limit": "An equality is as wide as its value, so that 0 fulfils it.",
    "wraps-around": "A step over the angle begins after its end and continues past the end of the cycle.",
}
