// Chains that random beginnings have led to, of which one is taken: how often each was found, and with which chance.
#include "integrators/chains.h"

#define CHAIN_BEGINNINGS 12
#define CHAIN_TRIALS 512    // more of these at the most, until one leads to the same chain

// By two numbers that tell where a chain goes, and the determinant of what its end does; and from how many beginnings. Chains that are nearer
// than `apart` and have determinants of one sign are one.
typedef struct {
    real u[CHAIN_BEGINNINGS], v[CHAIN_BEGINNINGS], turns[CHAIN_BEGINNINGS], times[CHAIN_BEGINNINGS];
} chain_list;

INLINE mask same_chain(real u, real v, real turns, real at_u, real at_v, real at_turns, real apart) {
    return less(fmax(fabs(u - at_u), fabs(v - at_v)), apart) & less(R(0.0), turns * at_turns);
}

// What beginning number `i` has led to, where it has.
INLINE void list_takes(chain_list *all, int i, real u, real v, real turns, real apart, mask fresh) {
    for (int k = 0; k < i; ++k) {
        const mask again = fresh & less(R(0.0), all->times[k]) & same_chain(all->u[k], all->v[k], turns, u, v, all->turns[k], apart);
        all->times[k] += pick(again, R(1.0), R(0.0));
        fresh &= ~again;
    }
    all->u[i] = u;
    all->v[i] = v;
    all->turns[i] = turns;
    all->times[i] = number_of(fresh);
}

// The one that is taken, and 1 over the chance of that among those that were found.
typedef struct {
    real u, v, turns, times, chances;
} listed_chain;

// One by a number in (0, 1), with about the probability of what it brings: 1 over its determinant, times a `scale`; below `least` chains bring
// no more.
INLINE listed_chain list_chooses(const chain_list *all, real choice, real scale, real least) {
    listed_chain c = {R(0.0), R(0.0), R(1.0), R(0.0), R(1.0)};
    real sum = R(0.0), weight = R(1.0);
    for (int i = 0; i < CHAIN_BEGINNINGS; ++i) {
        const mask here = less(R(0.0), all->times[i]);
        const real own = pick(here, R(1.0) / fmax(fabs(all->turns[i]) * scale + least, R(1e-6)), R(0.0)), next = sum + own, share = own / fmax(next, R(1e-20));
        const mask takes = here & less_equal(choice, share);
        choice = pick(takes, choice / fmax(share, R(1e-20)), fmin((choice - share) / fmax(R(1.0) - share, R(1e-20)), R(1.0)));
        weight = pick(takes, own, weight);
        c.u = pick(takes, all->u[i], c.u);
        c.v = pick(takes, all->v[i], c.v);
        c.turns = pick(takes, all->turns[i], c.turns);
        c.times = pick(takes, all->times[i], c.times);
        sum = next;
    }
    c.chances = sum / weight;
    return c;
}
