// Entry point: paths at their events, where no material has a film. It knows no formula.
#define SCATTER scatter_paths
#include "integrators/path_stages.h"
#include "shading/no_film.h"
#include "integrators/scatter_paths.h"
