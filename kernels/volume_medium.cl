// Entry point of media in a grid.
#include "volume.h"
#include "volume_alone.h"
#include "volume_medium.h"

VOLUME(volume_medium)
