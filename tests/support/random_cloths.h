// Random cloths that are hard for a solver: redundant and cyclic links, masses of 1 : 1000.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "tests/support/scenes.h"

namespace drape::test {

// The kinds, a row of kRandomKindNames each.
enum class RandomKind { kLinkage, kFrame, kChain, kTree, kNet, kSheet, kMesh };
inline constexpr std::array<std::string_view, 7> kRandomKindNames{
    "linkage", "frame", "chain", "tree", "net", "sheet", "mesh"};

// A cloth at rest lengths, turned at random, with random pins and velocities, undamped. Its name is
// its kind, its form and its seed. Links are inextensible.
// - linkage: rings and chains of tetrahedra, Bricard's ring of six, random points with links to
//   their neighbours
// - frame: trusses and box beams, braced once or twice
// - chain: straight, held by one end, by both or by none; masses log-uniform or by turns
// - tree: each particle hangs on an earlier one
// - net: squares with holes, masses log-uniform within 1 : 1000 or alternating
// - sheet: the same without holes, or with a hem of up to 1000 times the mass
// - mesh: triangles of random vertices, masses log-uniform
// The same on every machine.
Scene RandomCloth(RandomKind kind, uint64_t seed);

// What its gains of energy are measured by [J]: the weight of its free particles times its largest
// extent, plus the kinetic energy of its start.
double EnergyScale_j(const Scene& scene);

// Kinetic and potential energy of the free particles [J]. The velocity of a particle that
// constraints hold is off by up to half a substep of gravity (server/solver/method.md), so kinetic
// energy is counted without `lag_m_per_s`.
double Energy_j(const Scene& scene, const ParticleState& state, double lag_m_per_s);

}  // namespace drape::test
