"""All limits on studies and requests."""

from typing import Final

#: Axes of one study.
MAX_AXES: Final = 16
#: Columns of a table of cases: parameters that vary side by side. Eight pendulums have about 70.
MAX_COLUMNS: Final = 256
#: Derived parameters of one study.
MAX_DERIVED: Final = 100
#: Quantities of one study, and characters of the name of one.
MAX_QUANTITIES: Final = 50
MAX_QUANTITY_NAME: Final = 40
#: Least and most generations of a search.
GENERATIONS: Final = 1, 10_000
#: Parameters with tolerances of one study, and its drawn drives.
MAX_TOLERANCES: Final = 1_000
MAX_DRIVES: Final = 100_000
#: Fresh drives of the best designs of a search: unless told, and at most.
FRESH_DRIVES: Final = 500
MAX_FRESH_DRIVES: Final = 20_000
#: Correlations of one study.
MAX_CORRELATIONS: Final = 1_000
#: Starts of each case of one study, and initial values that differ between them.
MAX_STARTS: Final = 4_096
MAX_START_RANGES: Final = 24
#: Values of each initial value of a basin.
MAX_BASIN_POINTS: Final = 64
#: Cases of one study. Rows are run, stored and exported in blocks, but orders of cases, shared cases and columns of all
#: cases are arrays with a number for each case: 80 MB each at this limit, several at a time. More cases are more
#: studies, of which each is one file, one page and one dispatcher's work.
MAX_CASES: Final = 10_000_000
#: Values on all axes of one study together (they are stored with the study).
MAX_AXIS_VALUES: Final = 1_000_000
#: Cases of a study that chooses its own ones, rounds together: its cases are listed, and planned again and again.
MAX_PLANNED_CASES: Final = 100_000
#: Paths tied to one axis.
MAX_TIED_PATHS: Final = 256

#: Bytes of a spec, and of a request's body.
MAX_BODY_BYTES: Final = 1024 * 1024
#: Levels of nested lists and objects in a spec.
MAX_DEPTH: Final = 32
#: Characters of a study's name.
MAX_NAME_LENGTH: Final = 200
#: Characters of the notes on a study; tags of a study, and characters of one.
MAX_NOTES_LENGTH: Final = 10_000
MAX_TAGS: Final = 20
MAX_COMPONENTS: Final = 2_000
#: Saved views of a database, figures in the report of a study, and characters of the choices of a view.
MAX_VIEWS: Final = 10_000
MAX_REPORT_FIGURES: Final = 12
MAX_VIEW_QUERY: Final = 4_000
MAX_TAG_LENGTH: Final = 40
#: Characters of a search, and of the token of a page: it has what the list is sorted by.
MAX_SEARCH_LENGTH: Final = 200
MAX_PAGE_TOKEN: Final = 1_000
#: Characters of one quantity with its unit ("0.01 N*m*s/rad").
MAX_QUANTITY_LENGTH: Final = 80
#: Decimal digits of an integer in a spec; doubles end at about 308.
MAX_INTEGER_DIGITS: Final = 400
#: Faults reported about one spec; further ones are only counted.
MAX_PROBLEMS: Final = 100

#: Excitation periods of any case of a study.
MAX_RUN_PERIODS: Final = 1e6
#: Excitation periods of a search for the settled motion, and the largest order of an orbit.
MIN_SETTLED_PERIODS: Final = 100
MAX_SETTLED_PERIODS: Final = 100_000
MAX_ORBIT_PERIODS: Final = 64
#: Range of the scaled distance from its orbit below which a run counts as settled.
MIN_SETTLED: Final = 1e-10
MAX_SETTLED: Final = 1e-3
#: Cases of a selection that one answer or file can have.
MAX_SELECTED: Final = 100_000
#: Cases of a selection that a new study can have as its points.
MAX_POINTS_SELECTED: Final = 10_000
#: Smaller steps into which a step of a sweep is split where the motion jumps: by default, at least, at most.
NARROW_STEPS: Final = 16
MIN_NARROW_STEPS: Final = 2
MAX_NARROW_STEPS: Final = 1024
#: Range of the integrator's local relative error.
MIN_TOLERANCE: Final = 1e-14
MAX_TOLERANCE: Final = 1e-4

#: Rows of measured clutch data.
MAX_CLUTCH_ROWS: Final = 10_000
#: Different clutch laws of one study that are checked one by one.
MAX_CLUTCH_LAWS: Final = 10_000

#: Numbers in one answer of curves or of a map; exports have no such limit.
MAX_CURVE_VALUES: Final = 1_000_000
#: Studies or cases on one page.
MAX_PAGE_SIZE: Final = 1_000
#: Instants of one trajectory.
MIN_TRAJECTORY_POINTS: Final = 2
MAX_TRAJECTORY_POINTS: Final = 20_000

#: Values of the parameter of a bifurcation diagram, and strobes of each; strobes of a section.
MAX_DIAGRAM_VALUES: Final = 500
MAX_DIAGRAM_STROBES: Final = 200
MAX_SECTION_STROBES: Final = 5_000

#: Designs of a search that one answer gives; quantiles of one ribbon; drives in a list of the worst ones.
MAX_DESIGNS: Final = 1_000_000
MAX_QUANTILES: Final = 99
MAX_WORST: Final = 1_000

#: Priorities of studies lie between this and its negative.
MAX_PRIORITY: Final = 100

#: Days that the deadline of a study may lie ahead.
MAX_FINISH_DAYS: Final = 366
#: Studies that have not ended; a further one is refused.
MAX_WAITING_STUDIES: Final = 1_000
#: Streams of events that are open at once, and those of one user or token, where tokens are needed.
MAX_STREAMS: Final = 200
MAX_STREAMS_EACH: Final = 100
#: Simultaneous connections; a further one takes the place of one that waits for the rest of its request.
MAX_CONNECTIONS: Final = 800
#: Size of the head of a request, which the parser of HTTP would limit to 16 KiB, and of the address in it: that of a
#: new study can describe its machine.
MAX_HEAD_BYTES: Final = 64 * 1024
MAX_ADDRESS_BYTES: Final = 56 * 1024
#: Seconds within which the head of a request, and then its body, must arrive.
HEAD_SECONDS: Final = 20.0
BODY_SECONDS: Final = 60.0
#: Seconds within which a client must read part of its answer.
WRITE_SECONDS: Final = 60.0
#: Complete requests of one token or user in progress, where tokens are needed: half of the connections.
MAX_REQUESTS_EACH: Final = 400
#: Threads of requests that change something, and seconds for which such a request waits for one, and then for the write
#: lock of the database.
WRITING_THREADS: Final = 16
LOCK_SECONDS: Final = 30.0
#: Processes that write files of rows; files of one token, and of all tokens together, that are written or wait.
FILE_PROCESSES: Final = 3
MAX_FILES_EACH: Final = 32
MAX_FILES: Final = 64
#: Of these processes those that may send rows while they are read: as slowly as their clients read, so that some are
#: left for files that are kept.
SENDING_PROCESSES: Final = 2
#: Seconds for which a file waits for earlier ones of its token, and then for a process.
FILE_WAIT_SECONDS: Final = 600.0
#: Seconds within which a client must take one of the pieces in which rows are sent while they are read.
PIECE_SECONDS: Final = 600.0
#: Seconds of processor time, and bytes of memory, within which a file of rows must be written.
FILE_SECONDS: Final = 7200.0
FILE_BYTES: Final = 4 * 1024**3
#: Number of schedules.
MAX_SCHEDULES: Final = 1_000

#: Factor of the elapsed-time limit of a chunk over its processor-time limit, because busy machines are slow.
WALL_TIMES: Final = 10.0

#: Seconds within which a kernel must be compiled: many times what the largest takes on a slow, busy machine.
LOAD_SECONDS = 3600.0

#: Simultaneous checks of specs, fits and pictures of one token, and of all tokens together.
MAX_CHECKS_EACH: Final = 32
MAX_CHECKS: Final = 64
#: Simultaneous computations of one token, and of all tokens together.
MAX_COMPUTATIONS_EACH: Final = 6
MAX_COMPUTATIONS: Final = 8
#: Bytes that a computation of the engine, or the compilation of a kernel, may use.
COMPUTATION_BYTES: Final = 2 * 1024**3
