// Cones before the rays: one for each block of BLOCK x BLOCK pixels, which holds all rays of the block. As far as nothing is in
// the cone the block's rays need not look.
//
// Blocks belong to the whole picture's grid, as tiles do: what is rendered beside a pixel does not change where its ray begins.

// Number of a pass' block in the wave. A pass that begins or ends within a block has it nevertheless.
INLINE int blocks_of_tile(pass s) { return block_of_packet(s.end_packet - 1) - block_of_packet(s.first_packet) + 1; }
INLINE int block_in_wave(pass s, int tile, int packet) {
    return tile * blocks_of_tile(s) + block_of_packet(packet) - block_of_packet(s.first_packet);
}

// The middles of the blocks from number `first` of the wave on, pixels.
INLINE void block_middles(pass s, int first, int count, int first_tile, real *x, real *y) {
    scalar columns[LANES], rows[LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        const int block = min(first + lane, count - 1), of_tile = blocks_of_tile(s);
        const int pixel = (block % of_tile + block_of_packet(s.first_packet)) * BLOCK * BLOCK;
        const int4 corner = s.places[first_tile + block / of_tile];
        columns[lane] = (scalar)(corner.x + morton_column(pixel) + BLOCK / 2);
        rows[lane] = (scalar)(corner.y + morton_column(pixel >> 1) + BLOCK / 2);
    }
    *x = lanes_load(columns);
    *y = lanes_load(rows);
}

// The middle ray of a block as wide as all rays of its pixels, and `margin` more: `reach` pixels to each side.
INLINE ray block_cone(real x, real y, real reach, world w) {
    camera_sample at = {R(1.0), x, y, R(0.0), R(0.0), R(0.0), R(0.0)};
    ray axis = eye_ray(&at, w.view);
    real footprint = R(0.0), spread = R(0.0);
    for (int corner = 0; corner < TURNS(4); ++corner) {
        at.x = x + (corner & 1 ? reach : -reach);
        at.y = y + (corner & 2 ? reach : -reach);
        const ray r = eye_ray(&at, w.view);
        const vec offset = vec_cross(vec_sub(r.origin, axis.origin), axis.direction);
        const vec aside = vec_cross(r.direction, axis.direction);
        footprint = most(footprint, sqrt(vec_dot(offset, offset)));
        // A tangent: how far aside the ray is for each unit along the axis.
        spread = most(spread, sqrt(vec_dot(aside, aside)) / most(R(0.1), vec_dot(r.direction, axis.direction)));
    }
    const real wider = (real)(w.settings->cone_margin), detail = (real)(w.settings->detail);
    axis.footprint = axis.footprint * wider + footprint / detail;
    axis.spread = axis.spread * wider + spread / detail;
    return axis;
}

// Sends the cones of a packet of blocks, from number `first` of the wave on.
INLINE void cones_send(pass s, queue q, int first, int first_tile, world w) {
    real x, y;
    block_middles(s, first, q.wave, first_tile, &x, &y);
    const scalar filtered = s.sampling->samples > 1 ? S(0.5) * (scalar)s.sampling->filter_width : S(0.0);
    ray r = block_cone(x, y, (real)(S(0.5) * (scalar)BLOCK + filtered), w);
    // The bounds are widened by all that the cone can be wide there.
    const vec offset = vec_sub(r.origin, vec_splat(w.settings->bounds_center));
    const real radius = (real)(w.settings->bounds_radius), farthest = sqrt(vec_dot(offset, offset)) + R(2.0) * radius;
    const real widest = (real)(w.settings->detail) * (r.footprint + r.spread * farthest);
    const mask meets = ray_clip(&r, w.settings->bounds_center, radius + widest);
    queue_send(q, 0, first, r, meets);
    // Nobody marches what does not meet the bounds: nothing is there.
    ray_hit e = {0};
    e.t = (real)(REAL_LARGEST);
    KEEP_NUMBERS((const real *)&e, SHADOW_NUMBERS, q.met + first, q.stride);
}

// Where the rays of a packet's block begin, and what finding it has cost. A block in parts has its cone with each of them; it
// counts once, for the first sample of the block's first pixel.
INLINE real cone_end(stage s, const place_in_pass *here, int tile, counters *cost) {
    const __global scalar *met = s.q.met + block_in_wave(s.span, tile, here->packet);
    if (s.sample == 0 && here->packet % PACKETS_OF_BLOCK == 0) {
        scalar steps[LANES] = {met[ENCOUNTER_STEPS * s.q.stride]}, count[LANES] = {met[ENCOUNTER_COUNT * s.q.stride]};
        cost->steps += lanes_load(steps);
        cost->count += lanes_load(count);
    }
    return (real)(met[ENCOUNTER_T * s.q.stride]);
}
