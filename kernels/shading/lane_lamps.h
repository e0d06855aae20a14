// Lamps of a tree that lanes have chosen, each its own: points and balls are asked for together, by numbers that differ from lane to lane. Asked
// one after the other, as all other kinds are, each lamp would take as long as all of them.

typedef struct {
    vec place;
    color shines;
    real bright, radius, weakens, shadow;
    real point, ball;   // whether it is one
} lane_lamp;

// The lamps with numbers, as far as lanes ask for one.
INLINE lane_lamp lane_lamp_of(real number, mask asks, light_record lights) {
    scalar numbers[LANES], found[NUMBERS_OF(lane_lamp)][LANES];
    lanes_store(pick(asks, number, R(0.0)), numbers);
    for (int lane = 0; lane < LANES; ++lane) {
        light_record light = lights + (int)numbers[lane];
        for (int axis = 0; axis < 3; ++axis) {
            found[axis][lane] = light->vector[axis];
            found[3 + axis][lane] = light->color[axis];
        }
        found[6][lane] = light->intensity;
        found[7][lane] = light->radius;
        found[8][lane] = light->inverse_square ? S(1.0) : S(0.0);
        found[9][lane] = light->shadow ? S(1.0) : S(0.0);
        found[10][lane] = light->kind == LIGHT_POINT && light->spread <= S(0.0) ? S(1.0) : S(0.0);
        found[11][lane] = light->kind == LIGHT_SPHERE ? S(1.0) : S(0.0);
    }
    lane_lamp lamp;
    for (int i = 0; i < NUMBERS_OF(lane_lamp); ++i) ((real *)&lamp)[i] = lanes_load(found[i]);
    lamp.point = pick(asks, lamp.point, R(0.0));
    lamp.ball = pick(asks, lamp.ball, R(0.0));
    return lamp;
}

// As `light_sample`: of balls from `from`, of points, which have no size, from `point`.
INLINE light_ray lane_lamp_sample(const lane_lamp *lamp, vec from, vec point, real u, real v) {
    const mask ball = mask_of(lamp->ball);
    const real reach = lamp->radius * lamp->radius;
    real square, distance;
    const incidence in = incidence_from(lamp->place, vec_pick(ball, from, point), &square);
    const real strength = pick(mask_of(lamp->weakens), lamp->bright / square, lamp->bright);
    light_ray r = {in.toward, in.distance, color_scale(lamp->shines, LIGHT_PI * strength), R(0.0)};
    if (!any_lane(ball)) return r;
    const real spread = ball_light_spread(lamp->place, reach, from);
    r.toward = vec_pick(ball, cone_direction(in.toward, spread, u, v), r.toward);
    ball_light_met(lamp->place, reach, from, r.toward, &distance);
    r.distance = pick(ball, distance, r.distance);
    r.density = pick(ball, R(1.0) / (R(2.0) * LIGHT_PI * spread), r.density);
    r.light = color_pick(ball, color_scale(lamp->shines, lamp->bright), r.light);
    return r;
}
