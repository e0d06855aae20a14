// How bricks of voxels are stored. A brick's or node's place is packed into 64 bits: x, y and z in 21 bits each, x lowest.
#define BRICK 8
#define BRICK_VOXELS 512
#define BRICK_SIDE 9        // samples, so that what lies in a cell is found in one brick
#define BRICK_SAMPLES 729
#define BRICK_STRIDE 736    // samples from one brick to the next
#define OCTANT_VOXELS 64

#define PLACE_X(place) ((int)((place) & 0x1fffff))
#define PLACE_Y(place) ((int)(((place) >> 21) & 0x1fffff))
#define PLACE_Z(place) ((int)((place) >> 42))
