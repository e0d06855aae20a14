// Light that a spot sends along a path, and what a path has seen at its end.

// The light that one light ray adds, for every normal of the spot.
INLINE color lit_by(stage s, const spot *here, incidence in, mask lit, real open, vec to_viewer,
                    __constant const struct Light *light, look l) {
    color sum = color_of(R(0.0), R(0.0), R(0.0));
    for (int i = 0; i < TURNS(facet_count(s.bounce)); ++i) {
        const facet f = facet_of(s, here, i);
        const color one = shaded(here->tint, f.normal, to_viewer, in, lit, open, light, l);
        sum = color_add(sum, color_scale(one, f.weight));
    }
    return sum;
}

#if HAS_SET_LIGHTS
// The light of one of the rays to balls on the set. (After the lights stands one that is white, for them.)
INLINE color set_gathered(stage s, const spot *here, vec to_viewer, int turn, int of_set, real open, look l,
                          tally *cost, world w) {
    const place_in_pass place = place_of_packet(s.span, s.packet, s.tile);
    const encounter met = queue_met(s.q, turn, s.slot);
    tally_met(cost, met, 0);
    color shines;
    mask shadow;
    const int number = s.sample * w.settings->set_rays + of_set;
    const incidence in = set_incidence(here->point, here->normal, &place.at, number, s.bounce, w, &shines, &shadow);
    const color white = lit_by(s, here, in, ~mask_of(met.hit), open, to_viewer, w.lights + w.settings->light_count, l);
    return color_scale(color_mul(white, shines), (real)(S(1.0) / (scalar)w.settings->set_rays));
}
#endif

// The light that the spot's rays have brought.
INLINE color light_gathered(stage s, const spot *here, vec to_viewer, tally *cost, world w) {
    color gathered = color_of(R(0.0), R(0.0), R(0.0));
    const look l = look_of(here, w);
    real open = R(1.0);
    int turn = 0;
#if HAS_AMBIENT
    if (w.settings->occlusion_share > S(0.0)) open = R(0.0);
    for (; turn < hemisphere_turns(w); ++turn) {
        const encounter met = queue_met(s.q, turn, s.slot);
        tally_met(cost, met, 0);
        gathered = color_add(gathered, ambient_light(s, here, turn, met, surround_of(l), w, &open));
    }
    gathered = limited(gathered, w.settings);
#endif
    for (; turn < turns_for_light(w); ++turn) {
        const int number = turn - hemisphere_turns(w);
#if HAS_SET_LIGHTS
        const int of_set = number - w.settings->light_count * w.settings->light_rays;
        if (of_set >= 0) {
            gathered = color_add(gathered, set_gathered(s, here, to_viewer, turn, of_set, open, l, cost, w));
            continue;
        }
#endif
        __constant const struct Light *light = w.lights + number / w.settings->light_rays;
        if (number % w.settings->light_rays >= light->rays) continue;
        const encounter met = queue_met(s.q, turn, s.slot);
        tally_met(cost, met, 0);
        incidence in = light_at(light, here->point);
        in.toward = queue_ray(s.q, turn, s.slot).direction;
        if (light_is_seen(light)) in = light_along(light, here->point, in.toward);
        const color more = lit_by(s, here, in, ~mask_of(met.hit), open, to_viewer, light, l);
        gathered = color_add(gathered, color_scale(more, (real)(light->share)));
    }
#if HAS_OBJECTS
    gathered = color_add(gathered, l.emission);
#endif
    return gathered;
}

// The first thing that the eye sees here is a light, or a medium: a spot for depth and coverage, without light of others. `object`: -1
// for a light, or the number of the medium's.
INLINE void spot_of_light(stage s, spot *found, vec origin, vec direction, real far, real object, mask met) {
    if (!any_lane(met) || s.bounce > 0) return;
    sighting first;
    STATE_RECALL(s, first, STATE_SIGHTING);
    first.coverage = pick(met, R(1.0), first.coverage);
    STATE_KEEP(s, first, STATE_SIGHTING);
    found->found = pick(met, R(1.0), found->found);
    found->point = vec_pick(met, vec_along(origin, far, direction), found->point);
    found->seen = vec_pick(met, found->point, found->seen);
    found->normal = vec_pick(met, vec_scale(direction, R(-1.0)), found->normal);
#if HAS_MATTES
    found->object = pick(met, object, found->object);
#endif
    spot_keep(found, s.state, 0, s.stride);
}

// A path that meets a light before the surface ends there.
INLINE void path_meets_light(stage s, path *so_far, spot *found, ray arrived, world w) {
    real far = pick(mask_of(found->found), vec_dot(vec_sub(found->seen, arrived.origin), arrived.direction), (real)(REAL_LARGEST));
    color shows = color_of(R(0.0), R(0.0), R(0.0));
    real density = R(0.0), weight = R(0.0);
    const mask met = mask_of(so_far->on_path) & nearest_light(arrived.origin, arrived.direction, s.bounce == 0, &far, &shows, &density, &weight, w);
    if (!any_lane(met)) return;
    so_far->seen = color_pick(met, color_add(so_far->seen, color_mul(shows, so_far->through)), so_far->seen);
    so_far->on_path = number_of(mask_of(so_far->on_path) & ~met);
    spot_of_light(s, found, arrived.origin, arrived.direction, far, R(-1.0), met);
}

// Adds the light of the path's present spot, or of the sky past it, to what the path has seen.
INLINE void path_add(stage s, path *so_far, vec direction, real picture_y, const spot *here, color gathered, color mirrored,
                      int last, world w) {
    mask on_path = mask_of(so_far->on_path);
    const mask found = mask_of(here->found);
    if (s.bounce > 0) {
        const color missed = limited(color_mul(sky(direction, picture_y, 1, w), so_far->through), w.settings);
        so_far->seen = color_pick(on_path & ~found, color_add(so_far->seen, missed), so_far->seen);
    }
    on_path &= found;
    color own = color_of(R(1.0), R(1.0), R(1.0));
    if (!last) own = color_of(R(1.0) - mirrored.r, R(1.0) - mirrored.g, R(1.0) - mirrored.b);
    color added = color_mul(gathered, color_mul(so_far->through, own));
    if (s.bounce > 0) added = limited(added, w.settings);
    so_far->seen = color_pick(on_path, color_add(so_far->seen, added), so_far->seen);
    so_far->on_path = number_of(on_path);
}

// Goes on along the mirrored ray.
INLINE void path_mirror(stage s, path *so_far, vec direction, ray from_eye, real time, const spot *here, color mirrored, world w) {
    spot seen_first = *here;
    if (s.bounce > 0) seen_first = spot_kept(s.state, 0, s.stride);
    so_far->through = color_mul(so_far->through, mirrored);
    so_far->origin = vec_along(here->point, lift_of(here, w), here->normal);
    so_far->direction = vec_along(direction, R(-2.0) * vec_dot(direction, here->normal), here->normal);
    so_far->footprint = here->cone;
    so_far->spread = from_eye.spread + (from_eye.footprint / fmax(depth_of(seen_first.seen, time, w.view), here->cone));
#if HAS_OBJECTS
    const color left = so_far->through;
    so_far->on_path = number_of(mask_of(so_far->on_path) & less(R(0.0), fmax(fmax(left.r, left.g), left.b)));
#endif
    STATE_KEEP(s, *so_far, STATE_PATH);
    ray r = {so_far->origin, so_far->direction, R(0.0), (real)(REAL_LARGEST), so_far->footprint, so_far->spread,
             RAY_NOTHING_KNOWN};
    send_clipped(s, 0, r, R(0.0), WHICH, mask_of(so_far->on_path), w);
}

#if HAS_PARTS
// The normal by which a shot's first surface has scattered light; `own` is the surface's.
INLINE vec normal_seen(glance look, vec own) {
#if HAS_BUMP
    return look.normal;
#else
    return own;
#endif
}

// A shot's layers: of what its path has seen in all, `comes` is in the picture.
INLINE parts parts_of(glance look, color seen, real coverage, real comes) {
    parts found;
    found.albedo = color_scale(look.albedo, coverage);
    found.emission = color_scale(look.emission, comes);
    found.direct = color_scale(color_add(look.once, color_scale(look.emission, R(-1.0))), comes);
    found.indirect = color_scale(color_add(seen, color_scale(look.once, R(-1.0))), comes);
    found.normal = vec_of(R(0.0), R(0.0), R(0.0));
    return found;
}

// Keeps what the first spot reflects, white where it is a light, the light seen so far, and the normal of its relief, where it has one.
INLINE void glance_begin(stage s, mask surface, color albedo, color seen, vec normal) {
    glance look;
    look.albedo = color_pick(surface, albedo, color_of(R(1.0), R(1.0), R(1.0)));
    look.emission = look.once = seen;
#if HAS_BUMP
    look.normal = normal;
#endif
    STATE_KEEP(s, look, STATE_GLANCE);
}

// Keeps the light seen so far as that which was reflected once at most.
INLINE void glance_once(stage s, color seen) {
    glance look;
    STATE_RECALL(s, look, STATE_GLANCE);
    look.once = seen;
    STATE_KEEP(s, look, STATE_GLANCE);
}
#endif

#if PLANES > 0
// Where a plane's face is seen, it is what the shot has found: a part of the set.
INLINE void face_into(shot *result, plane_face face, ray from_eye) {
    const mask bare = mask_of(face.bare);
    result->hit |= bare;
    result->coverage = pick(bare, R(1.0), result->coverage);
    result->point = vec_pick(bare, vec_along(from_eye.origin, face.t, from_eye.direction), result->point);
    result->normal = vec_pick(bare, face.normal, result->normal);
    result->smooth = pick(bare, face.count, result->smooth);
#if HAS_MATTES
    result->thing = pick(bare, R(1.0), result->thing);
#endif
}
#endif

// The shot at its end: what its path has seen, over the background; and what it has found first.
INLINE shot shot_of(stage s, aim a, ray from_eye, color seen, const spot *here, world w) {
    sighting first;
    STATE_RECALL(s, first, STATE_SIGHTING);
    spot found = *here;
    if (s.bounce > 0) found = spot_kept(s.state, 0, s.stride);
#if HAS_PARTS
    glance look;
    STATE_RECALL(s, look, STATE_GLANCE);
    const color in_all = seen;
#endif
    shot result = {seen, mask_of(found.found), first.coverage, R(0.0), found.normal, found.seen, found.smooth, first.steps};
#if HAS_MATTES
    result.thing = pick(result.hit, found.object + R(1.0), R(0.0));
#endif
#if PLANES > 0
    plane_face face;
    STATE_RECALL(s, face, STATE_FACE);
    const mask bare = mask_of(face.bare);
#if HAS_PARTS
    look.albedo = color_pick(bare, face.tint, look.albedo);
#endif
    seen = color_pick(bare, face.tint, seen);
    face_into(&result, face, from_eye);
#endif
#if HAS_MATTES
    result.covers = result.coverage;
#endif
    result.depth = depth_of(result.point, a.time, w.view);
    color background = sky(from_eye.direction, a.y, 0, w);
#if HAS_FOG
    const real way = vec_dot(vec_sub(result.point, from_eye.origin), from_eye.direction);
    const color mist = color_splat(w.material->fog_color);
    const real passes = exp(-fog_depth(from_eye.origin, from_eye.direction, way, w.material));
    seen = color_mix(seen, mist, R(1.0) - passes);
    if (w.material->fog_background) {
        background = color_mix(mist, background, fog_passes_all(from_eye.origin, from_eye.direction, w.material));
    }
#endif
#if HAS_SHAFTS
    color air;
    STATE_RECALL(s, air, STATE_AIR);
    seen = color_add(seen, air);
#endif
#if HAS_GLOW
    color glow;
    STATE_RECALL(s, glow, STATE_GLOW);
    seen = color_add(seen, glow);
#endif
    // With a transparent background what is not hit adds nothing, so that R, G, B come out premultiplied.
    if (w.material->transparent) background = color_of(R(0.0), R(0.0), R(0.0));
#if HAS_SHAFTS
    background = color_add(background, air);
#endif
#if HAS_GLOW
    background = color_add(background, glow);
#endif
    seen = color_pick(result.hit, seen, background);
    result.radiance = color_mix(background, seen, result.coverage);
#if HAS_PARTS
    real comes = result.coverage;
#if HAS_FOG
    comes *= passes;
#endif
    result.of_light = parts_of(look, in_all, result.coverage, comes);
#endif
#if PLANES > 0
    plane_layers layers;
    STATE_RECALL(s, layers, STATE_LAYERS);
    result = planes_into(result, seen, background, layers, a.time, w.view);
#endif
#if HAS_PARTS
#if PLANES > 0
    const color past = color_add(result.of_light.albedo, color_scale(layers.behind, R(1.0) - comes));
    result.of_light.albedo = color_add(layers.front, color_scale(past, layers.front_through));
#endif
    result.of_light.normal = vec_pick(result.hit, vec_scale(normal_seen(look, result.normal), result.coverage), result.of_light.normal);
#endif
    return result;
}

#if HAS_PARTS
// The sums of layers before this sample; see `sums_before`.
INLINE parts parts_before(stage s, const place_in_pass *here) {
    parts sum = {0};
    if (s.sample > s.span.first) {
        STATE_RECALL(s, sum, STATE_PARTS);
    } else if (s.span.first > 0) {
        kept_parts(here->kept, s.span.slots + CHANNEL_COUNT, 0, &sum);
    }
    return sum;
}

// Adds the shots' layers to their pixels' sums, which are kept or written as those are.
INLINE void end_parts(stage s, const place_in_pass *here, parts more, mask wanted, real shots) {
    parts sum = parts_before(s, here);
    parts_add(&sum, more, wanted);
    if (s.sample + 1 < s.span.end) {
        STATE_KEEP(s, sum, STATE_PARTS);
        return;
    }
    const pass span = s.span;
    parts_write(span.film + here->tile * span.channel_count * TILE_PIXELS, span.slots, here->at.place, &sum, shots);
    if (span.mode & PASS_KEEP) kept_parts(here->kept, span.slots + CHANNEL_COUNT, 1, &sum);
}
#endif

#if HAS_MATTES
// Likewise which things they show; `sums` are those before.
INLINE void end_mattes(stage s, const place_in_pass *here, const pixel *sums, shot found, mask wanted, real offset) {
    mattes sum = {{0}};
    if (s.sample > s.span.first) {
        STATE_RECALL(s, sum, STATE_MATTES);
    } else if (s.span.first > 0) {
        kept_mattes(here->kept, s.span.slots + CHANNEL_COUNT, 0, &sum);
    }
    mattes_add(&sum, found.thing, found.covers, wanted, wanted & less(offset, sums->nearest));
    if (s.sample + 1 < s.span.end) {
        STATE_KEEP(s, sum, STATE_MATTES);
        return;
    }
    const pass span = s.span;
    const real shots = sums->shots + number_of(wanted);
    mattes_write(span.film + here->tile * span.channel_count * TILE_PIXELS, span.slots, here->at.place, &sum, shots);
    if (span.mode & PASS_KEEP) kept_mattes(here->kept, span.slots + CHANNEL_COUNT, 1, &sum);
}
#endif

// Adds the shots to their pixels' sums; after the launch's last sample these are written.
INLINE void end_shots(stage s, aim a, color seen, const spot *here, tally cost, world w) {
    const place_in_pass at = place_of_packet(s.span, s.packet, s.tile);
    const mask wanted = mask_of(a.wanted);
    const shot found = shot_of(s, a, eye_ray(&a, w.view), seen, here, w);
    pixel p = sums_before(s, &at);
#if HAS_MATTES
    end_mattes(s, &at, &p, found, wanted, a.offset);
#endif
    sample_add(&p, found, wanted, a.offset);
#if HAS_PARTS
    end_parts(s, &at, found.of_light, wanted, p.shots);
#endif
    const mask hit = wanted & less(R(0.0), found.coverage);
    pass_count(&at, (s.span.mode & PASS_ADD) || s.sample > s.span.first, a.wanted, number_of(hit), cost);
    if (s.sample + 1 < s.span.end) {
        STATE_KEEP(s, p, STATE_SUMS);
    } else {
        pass_write(s.span, &at, &p);
    }
}
