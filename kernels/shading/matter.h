// The numbers of an interaction's material, as they are kept.
#include "pbr.h"

INLINE void matter_keep(stage s, const pbr *p) {
    for (int first = 0; first < NUMBERS_OF(pbr); first += MOST_NUMBERS) {
        const int count = min(NUMBERS_OF(pbr) - first, MOST_NUMBERS);
        KEEP_NUMBERS((const real *)p + first, count, state_part(s, STATE_MATTER) + first * s.stride, s.stride);
    }
}

INLINE void matter_recall(stage s, pbr *p) {
    for (int first = 0; first < NUMBERS_OF(pbr); first += MOST_NUMBERS) {
        const int count = min(NUMBERS_OF(pbr) - first, MOST_NUMBERS);
        RECALL_NUMBERS((real *)p + first, count, state_part(s, STATE_MATTER) + first * s.stride, s.stride);
    }
}
