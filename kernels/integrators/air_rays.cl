// Entry points: light that fog scatters to the eye, before the first interaction. They know no formula.
#include "integrators/stages.h"
#include "shading/environment.h"
#include "shading/phase.h"
#include "integrators/interaction.h"
#include "shading/set_lights.h"
#include "shading/light_places.h"
#include "integrators/secondary.h"
#include "shading/fog.h"
#include "shading/air.h"

// Sends a ray for each light, in the turns from `next_turns` on. Beside it stands which part of the light it brings.
STAGE(send_air) {
    STAGE_BEGINS(s, w);
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const interaction found = interaction_kept(s, 0);
    const camera_sample a = camera_sample_kept(s);
    const ray r = eye_ray(&a, w.view);
    const real far = way_in_fog(s, r, &found, w);
    for (int i = 0; i < w.settings->light_count; ++i) {
        const scattering from = scattered(s, &here.at, r, far, i, w);
        const ray shadow_ray = {vec_along(r.origin, from.t, r.direction), from.in.toward, R(0.0), from.in.distance,
                          (r.footprint + r.spread * from.t) * (real)(w.settings->shadow_detail), R(0.0), RAY_NOTHING_KNOWN};
        const mask wanted = mask_of(a.wanted) & less(from.t, R(1e15)) & (w.lights[i].shadow ? ~0 : 0);
        send_clipped(s, next_turns + i, shadow_ray, R(0.0), WHETHER, wanted, w);
        lanes_store(from.share, ray_strength(s, next_turns + i));
    }
}

// Keeps what these rays bring to the end of the sample.
STAGE(gather_air) {
    STAGE_BEGINS(s, w);
    STATE_KEPT(s, counters, cost, STATE_COUNTERS);
    color air = color_of(R(0.0), R(0.0), R(0.0));
    for (int i = 0; i < w.settings->light_count; ++i) {
        const ray_hit met = queue_met(s.q, next_turns + i, s.slot);
        counters_met(&cost, met, 0);
        const color bright = color_scale(color_splat(w.lights[i].color), lanes_load(ray_strength(s, next_turns + i)));
        const color more = color_mul(color_splat(w.material->fog_scattering), bright);
        air = color_pick(mask_of(met.hit), air, color_add(air, more));
    }
    STATE_KEEP(s, air, STATE_AIR);
    STATE_KEEP(s, cost, STATE_COUNTERS);
}
