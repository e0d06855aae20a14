// A View while a shutter is open. Its poses are a list, evenly in time: at 0 the shutter opens, at 1 it closes. Each lane has a
// time of its own; between two poses all numbers are mixed. A view that stands still is one pose, whatever the time.
// All fields of the struct are as wide as a number, or fill up one.
#define POSE_NUMBERS ((int)(sizeof(struct View) / sizeof(scalar)))

// Called, since every ray from the eye asks for dozens of numbers, and the loop would stand in the text as often; and cold, or each of
// these branches would move registers into memory for it.
CALLED __attribute__((cold)) real view_number_at(__constant const scalar *number, real time, int spans) {
    scalar each[LANES];
    lanes_store(time * (real)((scalar)spans), each);
    for (int lane = 0; lane < LANES; ++lane) {
        const int place = (int)each[lane], pose = place < spans ? place : spans - 1;
        const scalar before = number[pose * POSE_NUMBERS], after = number[(pose + 1) * POSE_NUMBERS];
        each[lane] = before + (each[lane] - (scalar)pose) * (after - before);
    }
    return lanes_load(each);
}

INLINE real view_number(__constant const scalar *number, real time, int spans) {
    return spans == 0 ? (real)(*number) : view_number_at(number, time, spans);
}

INLINE vec view_vec(__constant const scalar *numbers, real time, int spans) {
    return vec_of(view_number(numbers, time, spans), view_number(numbers + 1, time, spans), view_number(numbers + 2, time, spans));
}

#define VIEW_NUMBER(view, field, time) view_number(&(view)->field, time, (view)->spans)
#define VIEW_VEC(view, field, time) view_vec((view)->field, time, (view)->spans)
