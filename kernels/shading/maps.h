// What differs from place to place in a material: a quantity through a table, or a picture. `clfractal/shading/maps.py` fills the
// records, and one buffer with all tables and pictures.

// One number of a picture, blended linearly between pixels; it repeats. `u`, `v` are 0 to 1 from its top left corner.
INLINE float picture_number(__global const float *pixels, int width, int height, scalar u, scalar v, int channel) {
    const scalar x = u * (scalar)width - S(0.5), y = v * (scalar)height - S(0.5);
    const int column = (int)floor(x), row = (int)floor(y);
    const float right = (float)(x - (scalar)column), low = (float)(y - (scalar)row);
    const int left = (column + width) % width, next = (column + 1) % width;
    __global const float *upper = pixels + 3 * width * ((row + height) % height) + channel;
    __global const float *lower = pixels + 3 * width * ((row + 1) % height) + channel;
    return mix(mix(upper[3 * left], upper[3 * next], right), mix(lower[3 * left], lower[3 * next], right), low);
}

// A picture at a place, in pictures, as sharp as `level` says: 0 is the picture, each next level half as wide (Williams 1983).
INLINE color picture_color(real u, real v, real level, map_record m, __global const float *tables) {
    scalar across[LANES], down[LANES], levels[LANES], found[3][LANES];
    lanes_store(u - floor(u), across);
    lanes_store(v - floor(v), down);
    lanes_store(level, levels);
    for (int lane = 0; lane < LANES; ++lane) {
        // What is not a number would be no place in the picture.
        const scalar x = across[lane] >= S(0.0) && across[lane] < S(1.0) ? across[lane] : S(0.0);
        const scalar y = down[lane] >= S(0.0) && down[lane] < S(1.0) ? down[lane] : S(0.0);
        const int sharp = min((int)levels[lane], m->levels - 1);
        const float share = (float)(levels[lane] - (scalar)sharp);
        __global const float *pixels = tables + m->picture;
        int width = m->width, height = m->height;
        for (int i = 0; i < sharp; ++i) {
            pixels += 3 * width * height;
            width = max(width / 2, 1);
            height = max(height / 2, 1);
        }
        __global const float *blurred = pixels + 3 * width * height;
        for (int i = 0; i < 3; ++i) {
            float number = picture_number(pixels, width, height, x, y, i);
            if (sharp + 1 < m->levels)
                number = mix(number, picture_number(blurred, max(width / 2, 1), max(height / 2, 1), x, y, i), fmin(share, 1.0f));
            found[i][lane] = (scalar)number;
        }
    }
    return color_of(lanes_load(found[0]), lanes_load(found[1]), lanes_load(found[2]));
}

INLINE real side_weight(real part, scalar sharpness) { return pow(fmax(fabs(part), R(1e-6)), (real)(sharpness)); }

// A picture shown along the three axes, blended by how much the surface faces each; its top is at the larger z or y.
INLINE color picture_at(vec point, vec normal, real cone, map_record m, __global const float *tables) {
    const real pixel = (real)(m->size / (scalar)m->width);
    const real level = log2(clamp(cone / pixel, R(1.0), R(65536.0)));
    const real wide = R(1.0) / (real)(m->size), high = wide * (real)((scalar)m->width / (scalar)m->height);
    const real x = side_weight(normal.x, m->sharpness), y = side_weight(normal.y, m->sharpness), z = side_weight(normal.z, m->sharpness);
    const real sum = x + y + z;
    color mixed = color_scale(picture_color(point.y * wide, -point.z * high, level, m, tables), x / sum);
    mixed = color_add(mixed, color_scale(picture_color(point.x * wide, -point.z * high, level, m, tables), y / sum));
    return color_add(mixed, color_scale(picture_color(point.x * wide, -point.y * high, level, m, tables), z / sum));
}

// What the surface is around an interaction: its normal and its escape count. On objects beside the set these are the object's.
INLINE void surface_beside(stage s, const interaction *there, int place, vec *normal, real *smooth, world w) {
    *normal = there->normal;
    *smooth = there->smooth;
    if (!w.settings->bump_surface) return;
    real known[4];
    RECALL_NUMBERS(known, 4, surface_beside_at(s, place, w), s.stride);
    *normal = vec_of(known[0], known[1], known[2]);
    *smooth = known[3];
    const mask beside_set = ~of_the_set(there->object, w);
    if (any_lane(beside_set)) {
        const vec down = vec_scale(there->normal, R(-1.0));
        const vec own = objects_normal(&there->point, &down, there->object, w.objects, w.settings->object_count, w.tables);
        *normal = vec_pick(beside_set, own, *normal);
        *smooth = pick(beside_set, there->smooth, *smooth);
    }
}

// At an interaction, where `place` is AT_INTERACTION, or at a place around it.
INLINE real map_quantity(stage s, const interaction *here, int place, map_record m, world w) {
    vec normal = here->normal;
    real smooth = here->smooth;
    if (m->asked >= 0) return lanes_load(asked_at(s, place, m->asked, w));
    if (place != AT_INTERACTION && m->of_surface) surface_beside(s, here, place, &normal, &smooth, w);
    return value_known(m->by, here->point, normal, smooth, here->residual, vec_splat(m->vector));
}

// What a map is at an interaction: a colour, or three times the same number.
INLINE color map_at(stage s, const interaction *here, int place, map_record m, world w) {
    real quantity;
    if (m->levels > 0) {
        const color seen = picture_at(here->point, here->normal, here->cone, m, w.tables);
        if (m->count == 3) return seen;
        quantity = seen.r;
    } else {
        quantity = map_quantity(s, here, place, m, w);
    }
    return palette_color(place_in_palette(quantity, m->scale, m->offset, m->repeat), m->repeat, w.tables + m->table);
}
