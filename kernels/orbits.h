// What all texts include that ask the formula.
#include "numbers/real.h"
#include "numbers/powers.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "solids.h"
