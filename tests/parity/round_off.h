// How far a backend in single precision may be from the reference, derived from counts of
// operations.
#pragma once

#include <cstdint>
#include <string>

#include "server/solver/backend.h"
#include "tests/support/scenes.h"

namespace drape::test {

// Largest numbers that a run meets; they scale the rounding of each operation.
struct RunScales {
  double coordinate_m = 0;           // |p| of particles and colliders
  double speed_m_per_s = 0;          // |v|
  double acceleration_m_per_s2 = 0;  // |g|
};

struct ErrorBound {
  double position_m = 0;
  double velocity_m_per_s = 0;
};

// Bound after M substeps of length h with `sweeps` sweeps in all (S = sweeps / M). With e = 2^-24,
// per particle of at most D constraints or springs of length at most L, K colliders, speeds up to U
// and coordinates up to X:
//   a constraint  d = (p_j - p_i) + h (u_j - u_i), |d|, C: 8 roundings of size L + h U; the impulse
//   is C/h
//                 times weights <= 1 (5 more relative roundings, |C| <= L); added to u (1 of size
//                 U)
//   a strip       the same for each of its links, and the elimination of N links 8 N roundings more
//   of
//                 their errors: impulses are off by more, but by what changes no velocity (its
//                 tridiagonal matrix is that of a projection). By cyclic reduction 18 roundings
//                 make the equation of a link and 17 what a level makes of it, and an impulse is
//                 made of N equations, N/2 of the first level, N/4 of the second, ...: less than
//                 35 N. What it subtracts are impulses; the coefficients are sums of one sign, of
//                 which a rounding changes no more than its own share, as in an elimination
//   the refinement  sweeps of its own over constraints
//   two steps     a rounding of b or u is extrapolated by 4/3 and 13/9 ..., at most 3/2 times as
//   large a contact     q, q - c, |q - c|, gap: 8 roundings of size X, over h; its direction is off
//   by 2 e X/R
//                 and 4 e, times impulses of at most U; a collider that moves: into its own
//   frame and back 24 roundings of X more, and 12 of the speed of its surface
//   a distance map  the first sample's place 1, q less it 2, three axes and dot products 4 each of
//   size
//                 2 X, 1/cell and the way to the grid 5: places are off by 32 e X. The gap by that
//                 times a gradient of at most sqrt(3), by three levels of interpolation between
//                 samples of at most 2 X, and by a root: 72 e X. The direction by 32 e X/R, and by
//                 9 roundings of each component of a gradient of length >= 1/2, its length and the
//                 turn: 48 e
//   a position    1 rounding of size X per substep, which constraints and contacts turn into X/h of
//   velocity a spring      8 roundings of k L and of c U, times h/m predict, integrate,
//   correct_velocity: 8 roundings of U + g h
//   the air       a triangle's change of velocity is at most its share q <= 1 of the relative
//   velocity R = |wind| + U: 48 roundings of q R; the direction of the triangle is off by 8 X/L
//   times the roundings of its corners so far; the corners' masses are shared, so that of one
//   particle is no larger (stretched by at most 2 in area)
//   an element    of bending or shear: 16 roundings of its extent and of U in its deflection and
//   its speed, and
//                 those of places so far, times what a particle gains by them (its share of the
//                 mass, at most 1/h^2)
// An impulse is a projection: it does not enlarge an error that is there already in the norm of
// kinetic energy, so errors add up over sweeps and substeps. Those of constraints and contacts have
// changing arguments and add like independent ones, with the square root of their number (each is
// counted with its largest size, 3 times the usual one); those of constant accelerations repeat and
// add one by one. An error of the velocity moves the position in every later substep.
ErrorBound RoundOffBound(const Scene& scene, const RunScales& scales, uint32_t substeps,
                         uint32_t sweeps, bool has_reduction = false);

// Steps the scene on both backends from the same state, rounded to single precision, and compares
// after every step: states within the bound (the message names the worst particle), sweeps and
// warnings equal. With a tolerance, constraints may be left with |C| <= tolerance L on either side
// and a sweep may decide otherwise, so a position may differ by twice that for each link on the way
// to a pin: `path_links`.
void ExpectParity(const std::string& backend_name, Scene scene, uint32_t steps,
                  uint32_t path_links = 0);

}  // namespace drape::test
