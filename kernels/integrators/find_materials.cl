// Entry point: the materials of interactions, where a scene has several, or one that differs from place to place. It knows no formula.
#include "integrators/stages.h"
#include "integrators/interaction.h"
#include "shading/phase.h"
#include "shading/flights.h"
#include "shading/media.h"
#include "shading/matter.h"
#include "shading/bump_places.h"
#include "shading/maps.h"
#include "shading/material_at.h"
#include "shading/bump.h"

// Keeps the numbers of a path's present interaction, and the slope of its relief.
STAGE(find_materials) {
    STAGE_BEGINS(s, w);
    if (paths_are_over(s)) return;
    interaction here = interaction_kept(s, bounce);
#if LANES > 1
    // These lanes may be gathered beside others (`lane_shares.h`), and what is looked up for all of them has to be numbers.
    if (!any_lane(mask_of(here.found))) {
        pbr nothing;
        for (int n = 0; n < NUMBERS_OF(pbr); ++n) ((real *)&nothing)[n] = R(0.0);
        matter_keep(s, &nothing);
        const relief flat = {R(0.0), vec_of(R(0.0), R(0.0), R(0.0))};
        if (KEEPS(s, STATE_RELIEF)) STATE_KEEP(s, flat, STATE_RELIEF);
    }
#endif
    if (!any_lane(mask_of(here.found))) return;
    const vec direction = ray_to_interaction(s, next_turns, w).direction;
    mask emerges = less(R(1.0), R(0.0));
    if (HAS(w, SUBSURFACE) && next_turns == 0) {
        const path_state with = path_state_kept(s);
        emerges = path_emerges(bounce, &with, &here, w);
    }
    here.normal = vec_pick(emerges, here.normal, facing(here.normal, direction));
    if (!is_colored_at_once(w.material)) here.tint = tint_of(&here, w);
    const pbr p = pbr_found(s, &here, w);
    matter_keep(s, &p);
    if (!KEEPS(s, STATE_RELIEF)) return;
    const relief slope = relief_at(s, &here, w);
    STATE_KEEP(s, slope, STATE_RELIEF);
}
