// Entry point of media in a grid with planes.
#include "volume.h"
#include "volume_formula.h"
#include "volume_medium.h"

VOLUME(volume_formula_medium)
