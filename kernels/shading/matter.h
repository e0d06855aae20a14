// The numbers of an interaction's material, as they are kept.
#include "pbr.h"

INLINE void matter_keep(stage s, const pbr *p) {
    for (int first = 0; first < NUMBERS_OF(pbr); first += MOST_NUMBERS) {
        const int count = min(NUMBERS_OF(pbr) - first, MOST_NUMBERS);
        STATE_KEEP_NUMBERS(s, (const real *)p + first, count, state_part(s, STATE_MATTER) + first * s.stride);
    }
}

INLINE void matter_recall(stage s, pbr *p) {
    for (int first = 0; first < NUMBERS_OF(pbr); first += MOST_NUMBERS) {
        const int count = min(NUMBERS_OF(pbr) - first, MOST_NUMBERS);
        STATE_RECALL_NUMBERS(s, (real *)p + first, count, state_part(s, STATE_MATTER) + first * s.stride);
    }
}
