// Entry point: paths at their events, where materials may have films. It knows no formula.
#define SCATTER scatter_films
#include "integrators/path_stages.h"
#include "elements/materials/costly/thin_film.h"
#include "integrators/scatter_paths.h"
