// Samples as pixels keep them: what has been seen, put together with all that lies before and behind it.

// The normal by which a sample's first surface has scattered light; `own` is the surface's.
INLINE vec normal_seen(aovs outputs, vec own, world w) { return HAS(w, BUMP) ? outputs.normal : own; }

// A sample's layers, of the part of its surface that is in the picture: `comes`. Of what its path has seen in all, that part is light; and a
// surface that fog hides must not tell the filter of detail where there is none.
INLINE parts parts_of(aovs outputs, color seen, vec normal, real comes, world w) {
    parts found;
    found.albedo = color_scale(outputs.albedo, comes);
    found.emission = color_scale(outputs.emission, comes);
    found.direct = color_scale(color_add(outputs.once, color_scale(outputs.emission, R(-1.0))), comes);
    found.indirect = color_scale(color_add(seen, color_scale(outputs.once, R(-1.0))), comes);
    const vec none = vec_of(R(0.0), R(0.0), R(0.0));   // where nothing is found there is no normal
    found.normal = vec_scale(vec_pick(less(R(0.0), comes), normal_seen(outputs, normal, w), none), comes);
    return found;
}

// Keeps what the first interaction reflects, white where it is a light, the light seen so far, and the normal of its relief, where it has one.
INLINE void aovs_begin(stage s, mask surface, color albedo, color seen, vec normal) {
    aovs outputs;
    outputs.albedo = color_pick(surface, albedo, color_of(R(1.0), R(1.0), R(1.0)));
    outputs.emission = outputs.once = seen;
    outputs.normal = normal;
    STATE_KEEP(s, outputs, STATE_AOVS);
}

// Keeps the light seen so far as that which was reflected once at most.
INLINE void aovs_once(stage s, color seen) {
    STATE_KEPT(s, aovs, outputs, STATE_AOVS);
    outputs.once = seen;
    STATE_KEEP(s, outputs, STATE_AOVS);
}

// The number of what is seen, from 1: a thing's, with faces of planes that have a material of their own behind all things, plane by plane
// (`clfractal/shading/cryptomatte.py`).
INLINE real shown_thing(real object, world w) {
    real number = thing_cut(object) + R(1.0);
    const real plane = plane_of_face(object), things = (real)((scalar)(w.settings->object_count + 1));
    for (int i = 0; i < w.planes.count; ++i) {
        const mask on = equal(plane, (real)((scalar)i));
        if (w.planes.planes[i].material >= 0) number = pick(on, number + (real)((scalar)(i + 1)) * things, number);
    }
    return number;
}

// The sample at its end: what its path has seen, over the background; and what it has found first.
INLINE pixel_sample sample_of(stage s, camera_sample a, ray from_eye, color seen, const interaction *here, world w) {
    STATE_KEPT(s, sighting, first, STATE_SIGHTING);
    interaction found = *here;
    if (s.bounce > 0) found = interaction_kept(s, 0);
    const color in_all = seen;
    const color on_the_way = color_pick(mask_of(found.found), color_of(R(0.0), R(0.0), R(0.0)), seen);
    pixel_sample result = {seen, mask_of(found.found), first.coverage, R(0.0), found.normal, found.seen, found.smooth, first.steps};
    result.thing = pick(result.hit, shown_thing(found.object, w), R(0.0));
    result.covers = result.coverage;
    result.depth = depth_of(result.point, a.time, w.view);
    real comes = pick(result.hit, result.coverage, R(0.0));
    color background = sky(from_eye.direction, a.y, 0, w);
    if (HAS(w, FOG)) {
        const real way = vec_dot(vec_sub(result.point, from_eye.origin), from_eye.direction);
        const color mist = color_splat(w.material->fog_color);
        const mask fogged = fog_at_eye(from_eye.origin, w);
        const real passes = pick(fogged, exp(-fog_depth(from_eye.origin, from_eye.direction, way, w.material)), R(1.0));
        seen = color_mix(seen, mist, R(1.0) - passes);
        comes *= pick(result.hit, passes, R(1.0));
        if (w.material->fog_background) {
            const real passes_all = pick(fogged, fog_passes_all(from_eye.origin, from_eye.direction, w.material), R(1.0));
            background = color_mix(mist, background, passes_all);
        }
    }
    color mist_light = color_of(R(0.0), R(0.0), R(0.0));
    if (KEEPS(s, STATE_MIST)) {
        STATE_KEPT(s, mist_seen, around, STATE_MIST);
        mist_light = around.light;
        const color before = color_scale(color_splat(w.material->fog_color), around.fogged);
        seen = color_add(color_add(color_scale(seen, around.passes), mist_light), before);
        background = color_add(color_scale(background, around.passes), mist_light);
        if (w.material->fog_background) background = color_add(background, before);
        comes *= pick(result.hit, around.passes, R(1.0));
    }
    color air = color_of(R(0.0), R(0.0), R(0.0)), glow = air;
    if (KEEPS(s, STATE_AIR)) STATE_RECALL(s, air, STATE_AIR);
    if (KEEPS(s, STATE_GLOW)) STATE_RECALL(s, glow, STATE_GLOW);
    seen = color_add(color_add(seen, air), glow);
    // With a transparent background what is not hit adds nothing, so that R, G, B come out premultiplied.
    if (w.material->transparent) background = mist_light;
    background = color_add(background, air);
    // What clouds have added to a ray that went through all of them.
    if (HAS(w, SHINING_CLOUDS)) background = color_add(background, on_the_way);
    background = color_add(background, glow);
    seen = color_pick(result.hit, seen, background);
    result.radiance = color_mix(background, seen, result.coverage);
    // The part of the light on rays' ways that comes: to surfaces, and past all.
    real of_ways = result.coverage, of_past = R(1.0) - result.coverage;
    plane_layers layers = {color_of(R(0.0), R(0.0), R(0.0))};
    color beside = layers.front;
    if (KEEPS(s, STATE_LAYERS)) {
        STATE_RECALL(s, layers, STATE_LAYERS);
        comes *= layers.front_through;
        of_ways *= layers.front_through;
        of_past *= layers.front_through * layers.behind_through;
        beside = color_scale(layers.behind, layers.front_through * (R(1.0) - result.coverage));
        result = planes_into(result, seen, background, layers, a.time, w.view);
    }
    if (!KEEPS(s, STATE_AOVS)) return result;
    STATE_KEPT(s, aovs, outputs, STATE_AOVS);
    result.of_light = parts_of(outputs, in_all, found.normal, comes, w);
    // Rays that meet nothing have seen what shines before it.
    const color past = color_scale(in_all, pick(mask_of(found.found), R(0.0), of_past));
    result.of_light.emission = color_add(color_add(result.of_light.emission, past), color_scale(color_add(glow, mist_light), of_ways + of_past));
    if (!KEEPS(s, STATE_LAYERS)) return result;
    result.of_light.albedo = color_add(color_add(layers.front, beside), result.of_light.albedo);
    result.of_light.normal = vec_pick(less(layers.nearest, (real)(REAL_LARGEST)), layers.normal, result.of_light.normal);
    return result;
}

// The sums of layers, or of the things that pixels show, are kept and written as those of `sums_before` are.
#define SUMS_BEFORE(s, here, type, sum, part, numbers)                                                             \
    type sum = {0};                                                                                             \
    if ((s).sample > (s).span.first) STATE_RECALL(s, sum, part);                                                \
    else if ((s).span.first > 0) numbers((here)->kept, (s).span.slots + CHANNEL_COUNT, 0, &sum)
#define SUMS_AFTER(s, here, sum, samples, part, numbers, write)                                                      \
    if ((s).sample + 1 < (s).span.end) {                                                                        \
        STATE_KEEP(s, sum, part);                                                                               \
        return;                                                                                                 \
    }                                                                                                           \
    __global float *tile_ = (s).span.framebuffer + (here)->tile * (s).span.channel_count * TILE_PIXELS;                \
    write(tile_, (s).span.slots, (here)->at.place, &sum, samples);                                                \
    if ((s).span.mode & PASS_KEEP) numbers((here)->kept, (s).span.slots + CHANNEL_COUNT, 1, &sum)

// Adds the samples' layers to their pixels' sums.
INLINE void end_parts(stage s, const place_in_pass *here, parts more, mask wanted, real samples) {
    SUMS_BEFORE(s, here, parts, sum, STATE_PARTS, kept_parts);
    parts_add(&sum, more, wanted);
    SUMS_AFTER(s, here, sum, samples, STATE_PARTS, kept_parts, parts_write);
}

// Likewise which things they show; `sums` are those before.
INLINE void end_cryptomatte(stage s, const place_in_pass *here, const pixel *sums, pixel_sample found, mask wanted, real offset) {
    SUMS_BEFORE(s, here, cryptomatte, sum, STATE_CRYPTOMATTE, kept_cryptomatte);
    cryptomatte_add(&sum, found.thing, found.covers, wanted, wanted & less(offset, sums->nearest));
    SUMS_AFTER(s, here, sum, sums->samples + number_of(wanted), STATE_CRYPTOMATTE, kept_cryptomatte, cryptomatte_write);
}

// Adds the samples to their pixels' sums; after the launch's last sample these are written.
INLINE void end_samples(stage s, camera_sample a, color seen, const interaction *here, counters cost, world w) {
    const place_in_pass at = place_of_packet(s.span, s.packet, s.tile);
    const mask wanted = mask_of(a.wanted);
    const pixel_sample found = sample_of(s, a, eye_ray(&a, w.view), seen, here, w);
    pixel p = sums_before(s, &at);
    if (KEEPS(s, STATE_CRYPTOMATTE)) end_cryptomatte(s, &at, &p, found, wanted, a.offset);
    sample_add(s.span, &p, found, wanted, a.offset);
    if (KEEPS(s, STATE_PARTS)) end_parts(s, &at, found.of_light, wanted, p.samples);
    const mask hit = wanted & less(R(0.0), found.coverage);
    pass_count(&at, (s.span.mode & PASS_ADD) || s.sample > s.span.first, a.wanted, number_of(hit), cost);
    if (s.sample + 1 < s.span.end) {
        STATE_KEEP(s, p, STATE_SUMS);
    } else {
        pass_write(s.span, &at, &p);
    }
}
