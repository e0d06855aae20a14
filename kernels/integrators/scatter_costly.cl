// Entry point: paths at their events, where materials may have costly parts. It knows no formula.
#define SCATTER scatter_costly
#include "integrators/path_stages.h"
#include "elements/materials/costly"
#include "integrators/scatter_paths.h"
