// Garments made by rule: irregular triangle meshes whose numbers come from a seed. They hang by
// some of their vertices, and stretch like woven fabric unless told otherwise.
#pragma once

#include <cstdint>
#include <vector>

#include "server/scene/description.h"
#include "tests/support/scenes.h"

namespace drape::test {

// Where a garment is described, and how large its cells are.
struct GarmentOptions {
  uint32_t seed = 1;
  double cell_m = 0.05;
  double areal_density_kg_per_m2 = 0.2;
  double bending_rigidity_n_m = 0;
  double stretch_stiffness_n_per_m = kMeshStretchStiffness_n_per_m;
  RigidTransform transform{};
};

// A sheet of 1 m x 1 m whose vertices are off their places by up to 0.3 of a cell and whose
// diagonals are drawn at random, by two corners.
Scene IrregularSheet(const GarmentOptions& options);

// The same, held by nothing.
Scene LooseIrregularSheet(const GarmentOptions& options);

// A tube with two sleeves, set into holes of its sides, by its collar.
Scene Shirt(const GarmentOptions& options);

// A tube that is narrow at the waist and wide at the hem, with a dart in front: a wedge that is cut
// out and sewn together, by its upper rim.
Scene Dress(const GarmentOptions& options);

// A strip of `cells` cells and one that is clamped, four cells wide, of an irregular mesh: flat,
// held by the vertices of its first two columns. The last vertex of each row is at its end.
Scene ClampedStrip(uint32_t cells, double cell_m, const StructuralMaterial& material,
                   uint32_t seed);

// All garments.
std::vector<Scene> Garments(const GarmentOptions& options);

}  // namespace drape::test
