// Entry point: paths at their events, where no material has a costly part. It knows no formula.
#define SCATTER scatter_paths
#include "integrators/path_stages.h"
#include "shading/plain_materials.h"
#include "integrators/scatter_paths.h"
