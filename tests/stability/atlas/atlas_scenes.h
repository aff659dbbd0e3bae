// The scenes of the atlas. Plain values; random numbers have a fixed seed.
#pragma once

#include "tests/stability/atlas/atlas.h"

namespace drape::test {

// side x side particles, 1 m, hung by two corners 0.9 m apart, let go horizontally (with 1 m
// between the corners the first row could not move): an arc along the row, every link of its
// length.
Scene HungSheet(uint32_t side, const StructuralMaterial& material = {});

// 20 links, 1 m, pinned at one end, let go horizontally; the other end `ratio` times as heavy as
// the other particles.
Scene LoadedRope(double ratio);
// The hung sheet with a last row, or with every other particle, `ratio` times as heavy.
Scene HeavyHem(uint32_t side, double ratio);
Scene MixedMasses(uint32_t side, double ratio);

// By their place in the list: rows of the tables.
using NamedCase = std::pair<std::string, AtlasCase>;
// Constraints that contradict each other, of which there are more than motions, or that lock.
std::vector<NamedCase> ConstraintCases();
// Starts without direction, volume or room. If positions violate the lengths, both lists have the
// server's correction of them (scene/start_positions.h, solver/cloth_start.h).
std::vector<NamedCase> StartCases();
// Variants of the last of them: sheets described through the middle of a collider, over a floor.
std::vector<NamedCase> CaughtCases();

// A free sheet that hits a collider at this speed. By place: sphere, plane, thin box, capsule.
std::vector<std::string> ImpactColliders();
AtlasCase Impact(size_t collider, double speed_m_per_s);

// The hung sheet whose pins jump this far and back, every tenth step, for the first second.
AtlasCase TeleportingPins(double distance_m, double time_step_s);

// Scenes that are stepped a million times: a hung sheet, a sheet on a sphere, a loaded rope.
std::vector<NamedCase> SoakCases();

}  // namespace drape::test
