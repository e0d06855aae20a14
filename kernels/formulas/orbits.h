// What all texts include that ask the formula.
#include "formulas/numbers/real.h"
#include "formulas/numbers/powers.h"
#include "device/vectors.h"
#include "structs.h"
#include "formula.h"
#include "formulas/solids.h"
