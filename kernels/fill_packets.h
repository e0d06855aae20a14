// Packets whose orbits are computed side by side, so that one goes on while another waits for a result. Where there is one
// lane, the device has other work-items for that.
#if LANES == 1
#define PACKETS 1
#else
#define PACKETS 2
#endif
