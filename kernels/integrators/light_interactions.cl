// Entry point: the light of interactions by Phong's model. It knows no formula.
#include "integrators/stages.h"
#include "shading/environment.h"
#include "shading/sky.h"
#include "shading/phase.h"
#include "integrators/interaction.h"
#include "integrators/secondary.h"
#include "shading/fog.h"
#include "shading/phong_material.h"
#include "integrators/lit.h"
#include "integrators/pixel_samples.h"

// Gathers the light of the interactions. Where the path ends here, its sample ends too; else its mirrored ray is sent.
STAGE(light_interactions) {
    STAGE_BEGINS(s, w);
    const camera_sample a = camera_sample_kept(s);
    interaction found = interaction_kept(s, bounce);
    STATE_KEPT(s, counters, cost, STATE_COUNTERS);
    path so_far;
    const ray arrived = path_ray(s, eye_ray(&a, view), a.wanted, &so_far);
    const vec direction = arrived.direction;
    if (KEEPS(s, STATE_LIGHT_BEFORE)) path_ends_at_light(s, &so_far);
    color gathered = color_of(R(0.0), R(0.0), R(0.0));
    if (any_lane(mask_of(found.found))) {
        if (!is_colored_at_once(w.material)) found.tint = tint_of(&found, w);
        if (KEEPS(s, STATE_GATHERED)) STATE_RECALL(s, gathered, STATE_GATHERED);
        else gathered = light_gathered(s, &found, vec_scale(direction, R(-1.0)), &cost, w);
        gathered = color_pick(on_face(&found), found.tint, gathered);
    }
    if (bounce == 0 && KEEPS(s, STATE_AOVS)) {
        aovs_begin(s, mask_of(so_far.on_path) & mask_of(found.found), found.tint, color_of(R(0.0), R(0.0), R(0.0)), found.normal);
    }
    const int last = bounce == settings->bounces;
    const color mirrored = color_pick(on_face(&found), color_of(R(0.0), R(0.0), R(0.0)), mirrored_at(&found, direction, w));
    path_add(s, &so_far, direction, a.y, &found, gathered, mirrored, last, w);
    if (!last) {
        STATE_KEEP(s, cost, STATE_COUNTERS);
        path_mirror(s, &so_far, direction, eye_ray(&a, view), a.time, &found, mirrored, w);
        return;
    }
    end_samples(s, a, so_far.seen, &found, cost, w);
}
