// What the programs with NvCloth share: the callbacks that the library needs, and sheets made of
// quads. Part of those that nvcloth.py builds, no part of the CMake build.
#pragma once

#include <NvCloth/Callbacks.h>
#include <NvCloth/Cloth.h>
#include <NvCloth/Fabric.h>
#include <NvCloth/Factory.h>
#include <NvCloth/Solver.h>
#include <NvClothExt/ClothFabricCooker.h>
#include <foundation/PxErrorCallback.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

namespace nvcloth_host {

using physx::PxVec3;
using physx::PxVec4;

constexpr double kFrame_s = 1.0 / 60;

struct Allocator final : physx::PxAllocatorCallback {
  void* allocate(size_t size, const char*, const char*, int) override {
    return std::aligned_alloc(64, (size + 63) / 64 * 64);
  }
  void deallocate(void* memory) override { std::free(memory); }
};

struct Errors final : physx::PxErrorCallback {
  void reportError(physx::PxErrorCode::Enum, const char* message, const char*, int) override {
    std::fprintf(stderr, "NvCloth: %s\n", message);
    std::exit(1);
  }
};

struct Asserts final : nv::cloth::PxAssertHandler {
  void operator()(const char* condition, const char*, int, bool&) override {
    std::fprintf(stderr, "NvCloth: assertion %s\n", condition);
    std::exit(1);
  }
};

// Once per process.
inline nv::cloth::Factory* MakeFactory() {
  static Allocator allocator;
  static Errors errors;
  static Asserts asserts;
  nv::cloth::InitializeNvCloth(&allocator, &errors, &asserts, nullptr);
  return NvClothCreateFactoryCPU();
}

// Of side x side particles, whose inverse masses are their w. Quads, from which the cooker makes
// rows, columns, both diagonals, bending over two edges and, as particles are held, geodesic
// tethers. The vector only says which edges are vertical.
inline nv::cloth::Fabric* Cook(nv::cloth::Factory* factory, const std::vector<PxVec4>& particles,
                               uint32_t side) {
  std::vector<uint32_t> quads;
  for (uint32_t a = 0; a + side < particles.size(); ++a) {
    if (a % side + 1 < side) quads.insert(quads.end(), {a, a + 1, a + 1 + side, a + side});
  }
  nv::cloth::ClothMeshDesc mesh;
  mesh.points.data = particles.data();
  mesh.points.stride = sizeof(PxVec4);
  mesh.points.count = static_cast<uint32_t>(particles.size());
  mesh.invMasses.data = &particles[0].w;
  mesh.invMasses.stride = sizeof(PxVec4);
  mesh.invMasses.count = static_cast<uint32_t>(particles.size());
  mesh.quads.data = quads.data();
  mesh.quads.stride = 4 * sizeof(uint32_t);
  mesh.quads.count = static_cast<uint32_t>(quads.size() / 4);
  return NvClothCookFabricFromMesh(factory, mesh, PxVec3(0, 0, 1), nullptr, true);
}

// All phases at full stiffness within a frame, so many iterations in each, no air. With the
// library's 10 Hz, sheets without tethers stretch more.
inline nv::cloth::Cloth* MakeCloth(nv::cloth::Factory* factory, nv::cloth::Fabric& fabric,
                                   const std::vector<PxVec4>& particles, int iterations) {
  nv::cloth::Cloth* cloth =
      factory->createCloth({particles.data(), particles.data() + particles.size()}, fabric);
  std::vector<nv::cloth::PhaseConfig> phases;
  for (uint32_t phase = 0; phase < fabric.getNumPhases(); ++phase) {
    phases.emplace_back(static_cast<uint16_t>(phase));
  }
  cloth->setPhaseConfig({phases.data(), phases.data() + phases.size()});
  cloth->setDamping(PxVec3(0.0f));
  cloth->setLinearDrag(PxVec3(0.0f));
  cloth->setAngularDrag(PxVec3(0.0f));
  cloth->setDragCoefficient(0);
  cloth->setLiftCoefficient(0);
  cloth->setSolverFrequency(static_cast<float>(iterations / kFrame_s));
  cloth->setStiffnessFrequency(static_cast<float>(1 / kFrame_s));
  return cloth;
}

inline void Simulate(nv::cloth::Solver& solver) {
  solver.beginSimulation(static_cast<float>(kFrame_s));
  for (int chunk = 0; chunk < solver.getSimulationChunkCount(); ++chunk) {
    solver.simulateChunk(chunk);
  }
  solver.endSimulation();
}

}  // namespace nvcloth_host
