// The largest distance of a backend in single precision from the reference, derived from counts of
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
//  - A constraint: 8 roundings of size L + h U in d = (p_j - p_i) + h (u_j - u_i), |d| and C. The
//    impulse is C/h times weights <= 1 (5 more relative roundings, |C| <= L); adding it to u is 1
//    of size U.
//  - A strip: the same for each of its links, and 8 N roundings of their errors for the elimination
//    of N links. Impulses have larger errors, but those change no velocity (the tridiagonal matrix
//    is that of a projection). By cyclic reduction, 18 roundings make the equation of a link, 17
//    each level's new equation, and an impulse is made of N equations, N/2 of the first level, N/4
//    of the second, ...: less than 35 N. It subtracts impulses; the coefficients are sums of one
//    sign, of which a rounding changes no more than its own share, as in an elimination. From both
//    ends some levels of it leave systems of at most N/2 links for an elimination: no more. Nor
//    have lanes of four particles, where 3 N/4 equations take 12 roundings for the link before and
//    7 for the one after.
//  - The refinement: its own sweeps over constraints.
//  - Two steps: a rounding of b or u is extrapolated by 4/3 and 13/9 ..., at most 3/2 times as
//    large.
//  - A contact: 8 roundings of size X, over h, in q, q - c, |q - c| and the gap. The error of its
//    direction is 2 e X/R + 4 e, times impulses of at most U. A collider that moves adds 24
//    roundings of X for the change to its frame and back, and 12 of the speed of its surface.
//  - A distance map: the first sample's place takes 1 rounding, q less that place 2, three axes and
//    dot products 4 each of size 2 X, 1/cell and the way to the grid 5: the error of places is 32 e
//    X. The gap has this error times a gradient of at most sqrt(3), three levels of interpolation
//    between samples of at most 2 X, and a root: 72 e X. The direction has 32 e X/R, and 9
//    roundings of each component of a gradient of length >= 1/2, its length and the turn: 48 e.
//  - A position: 1 rounding of size X per substep, which constraints and contacts turn into X/h of
//    velocity.
//  - A spring: 8 roundings of k L and of c U, times h/m.
//  - predict, integrate, correct_velocity: 8 roundings of U + g h.
//  - The air: a triangle's change of velocity is at most its share q <= 1 of the relative velocity
//    R = |wind| + U: 48 roundings of q R. The error of the triangle's direction is 8 X/L times the
//    roundings of its corners so far. The corners' masses are shared, so the change of one particle
//    is no larger (stretched by at most 2 in area).
//  - An element of bending or shear: 16 roundings of its extent and of U in its deflection and its
//    speed, and the roundings of positions so far, times the particle's gain by them (its share of
//    the mass, at most 1/h^2).
// An impulse is a projection: in the norm of kinetic energy it does not enlarge an existing error,
// so errors add up over sweeps and substeps. Errors of constraints and contacts have changing
// arguments and add like independent ones, with the square root of their number (each is counted
// with its largest size, 3 times the usual one). Errors of constant accelerations repeat and add
// one by one. An error of the velocity moves the position in every later substep.
ErrorBound RoundOffBound(const Scene& scene, const RunScales& scales, uint32_t substeps,
                         uint32_t sweeps, bool has_reduction = false);

// Steps the scene on both backends from the same state, rounded to single precision, and compares
// after every step: states within the bound (the message names the worst particle), sweeps and
// warnings equal. With a tolerance, constraints may be left with |C| <= tolerance L on either side
// and a sweep may decide otherwise, so a position may differ by twice that for each link on the way
// to a pin: `path_links`. With restitution a hit is an event, which rounding may move by a substep:
// then a state within the bound of a start that differs by rounding is right, too.
void ExpectParity(const std::string& backend_name, Scene scene, uint32_t steps,
                  uint32_t path_links = 0);

}  // namespace drape::test
