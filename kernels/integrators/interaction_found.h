// What becomes of an interaction that has been found.
#include "integrators/interaction.h"
#include "integrators/secondary.h"

// Keeps it, or the face of a cut before it, and sends the rays that bring its light. `r`: the ray that has met it.
INLINE void interaction_found(stage s, ray r, real on_path, interaction found, sighting at_first, counters cost, int next_turns, world w) {
    if (KEEPS(s, STATE_FACE)) at_first.coverage = pick(interaction_on_face(s, r, &found, w), R(1.0), at_first.coverage);
    if (s.bounce == 0) STATE_KEEP(s, at_first, STATE_SIGHTING);
    STATE_KEEP(s, cost, STATE_COUNTERS);
    found.found = pick(mask_of(on_path), found.found, R(0.0));
    if (w.material->known == KNOWN_WITH_POINTS)
        found.quantity = value_known(w.material->coloring, found.point, found.normal, found.smooth, found.residual, found.normal);
    interaction_keep(s, &found, s.bounce);
    if (!KEEPS(s, STATE_GATHERED)) send_to_small_lights(s, &found, next_turns, w);
}
