// Entry point that knows the formula: what chooses the colour of interactions, where that asks the formula.
#include "formulas/orbits.h"
#include "integrators/stages.h"
#include "shading/coloring.h"
#include "shading/bump_places.h"

// Keeps what the formula answers at interactions, or at a place around them. On objects beside the set it has an answer for traps only.
INLINE void answers_keep(stage s, const interaction *there, int place, mask asks, mask of_set, material_record questions,
                         orbit_record orbit, constants k, world w) {
    // After the scene's own record.
    const int count = place == AT_INTERACTION ? w.settings->asked_count : w.settings->bump_asked;
    for (int i = 0; i < count; ++i) {
        material_record m = questions + i;
        const mask answered = m->of_objects ? asks : of_set;
        const real found = coloring_quantity(there->point, there->normal, there->normal, there->cone, answered, m, orbit, k);
        const real answer = pick(answered, found, R(0.0));
        lanes_store(answer, asked_at(s, place, i, w));
    }
    if (place == AT_INTERACTION || !w.settings->bump_surface) return;
    surface_point surface;
    const clearance here = orbit_dual_distance(there->point, of_set, OF_SURFACE, orbit, k, &surface);
    const vec normal = vec_normalize(surface.gradient);
    // Where there is none, as at the interaction.
    const mask flat = less(vec_dot(normal, normal), R(0.5)) | here.end.inside;
    const vec known = vec_pick(flat, there->normal, normal);
    const real numbers[4] = {known.x, known.y, known.z, smooth_count(here.end, surface, orbit)};
    KEEP_NUMBERS(numbers, 4, surface_beside_at(s, place, w), s.stride);
}

STAGE(color_interactions) {
    STAGE_BEGINS(s, w);
    interaction here = interaction_kept(s, bounce);
    const mask seen = mask_of(here.found), found = seen & of_the_set(here.object, w);
    if (!any_lane(settings->asked_count > 0 ? seen : found)) return;
    const vec direction = ray_to_interaction(s, next_turns, w).direction;
    interaction there = here;
    const real width = HAS(w, BUMP) ? bump_width(&here, w) : R(-1.0);
    const mask rises = less(R(0.0), width);
    const int around = any_lane(seen & rises) ? BUMP_PLACES : 0;
    // At the interaction, then around it.
    for (int place = AT_INTERACTION; place < around; ++place) {
        mask asks = seen;
        if (place != AT_INTERACTION) {
            there = bump_interaction(&here, width, place);
            asks &= rises;
        }
        answers_keep(s, &there, place, asks, asks & found, material + 1, orbit, k, w);
    }
    if (material->known != KNOWN_BY_FORMULA) return;
    here.quantity = coloring_quantity(here.point, here.normal, direction, here.cone, found, material, orbit, k);
    interaction_keep(s, &here, bounce);
}
