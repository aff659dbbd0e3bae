// Cloths of one world on a backend.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/solver/backend.h"
#include "tests/support/scenes.h"

namespace drape::test {

// The states of scenes are in the frame of the world; each cloth gets a frame of its own.
class ClothWorld {
 public:
  // Of another number than worlds of other cloths. The backend outlives it.
  ClothWorld(Backend& backend, uint64_t world, std::vector<Scene> scenes);
  ~ClothWorld();
  ClothWorld(const ClothWorld&) = delete;
  ClothWorld& operator=(const ClothWorld&) = delete;

  const std::vector<ClothHandle>& cloths() const { return cloths_; }
  const Scene& scene(size_t index) const { return scenes_[index]; }
  // Of a step of all of them.
  std::vector<StepItem> Items(bool measure = false) const;
  // Steps them all; the last reports.
  std::vector<StepReport> Step(uint32_t steps = 1, bool measure = false);
  // In the frame of the world.
  ParticleState State(size_t index) const;
  // Of all of them, cloth after cloth, in their own frames.
  std::string Bits() const;
  // Edges that go through triangles, exactly, of all cloths as one surface: counted without the
  // surface of the world.
  size_t Crossings() const;

 private:
  Backend& backend_;
  const uint64_t world_;
  std::vector<Scene> scenes_;
  std::vector<Eigen::Vector3d> origins_m_;  // of the cloths' frames
  std::vector<ClothHandle> cloths_;
};

}  // namespace drape::test
