// A scene of `drape_bench contact` with NvCloth, whose self-collision keeps particles apart; built
// and run by nvcloth_contact.py, no part of the CMake build.
// Usage: nvcloth_contact PLAY POSITIONS ITERATIONS DISTANCE_M
// Prints milliseconds per frame, mean and worst, of the thread; writes the positions of all frames.
#include <NvCloth/Callbacks.h>
#include <NvCloth/Cloth.h>
#include <NvCloth/Fabric.h>
#include <NvCloth/Factory.h>
#include <NvCloth/Solver.h>
#include <NvClothExt/ClothFabricCooker.h>
#include <foundation/PxErrorCallback.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <vector>

namespace {

using physx::PxVec3;
using physx::PxVec4;

constexpr float kFrame_s = 1.0f / 60;
constexpr float kFriction = 0.3f;  // of contact_scenes.cpp

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

struct Target {
  uint32_t particle;
  PxVec3 place_m;
};

struct Frame {
  std::vector<PxVec4> planes, spheres;
  std::vector<Target> targets;
};

// As peer_plays.h describes it.
struct Play {
  uint32_t columns = 0;
  std::vector<PxVec4> rest, start;  // w: inverse mass
  std::vector<uint32_t> triangles;
  std::vector<Frame> frames;
};

std::vector<PxVec4> ReadVectors(std::ifstream& file) {
  size_t count = 0;
  file >> count;
  std::vector<PxVec4> vectors(count);
  for (PxVec4& v : vectors) file >> v.x >> v.y >> v.z >> v.w;
  return vectors;
}

Play ReadPlay(const char* path) {
  std::ifstream file(path);
  Play play;
  size_t particles = 0, triangles = 0, frames = 0;
  file >> particles >> triangles >> play.columns >> frames;
  play.rest.resize(particles);
  play.start.resize(particles);
  for (size_t i = 0; i < particles; ++i) {
    file >> play.rest[i].x >> play.rest[i].y >> play.rest[i].z;
    file >> play.start[i].x >> play.start[i].y >> play.start[i].z >> play.start[i].w;
    play.rest[i].w = play.start[i].w;
  }
  play.triangles.resize(3 * triangles);
  for (uint32_t& corner : play.triangles) file >> corner;
  play.frames.resize(frames);
  for (Frame& frame : play.frames) {
    frame.planes = ReadVectors(file);
    frame.spheres = ReadVectors(file);
    size_t targets = 0;
    file >> targets;
    frame.targets.resize(targets);
    for (auto& [particle, p] : frame.targets) file >> particle >> p.x >> p.y >> p.z;
  }
  if (!file || particles == 0) {
    std::fprintf(stderr, "%s is no play\n", path);
    std::exit(2);
  }
  return play;
}

// Grids as quads, from which the cooker makes rows, columns, both diagonals and bending.
nv::cloth::Fabric* Cook(nv::cloth::Factory* factory, const Play& play) {
  std::vector<uint32_t> quads;
  if (const uint32_t side = play.columns; side > 0) {
    for (uint32_t a = 0; a + side < play.rest.size(); ++a) {
      if (a % side + 1 < side) quads.insert(quads.end(), {a, a + 1, a + 1 + side, a + side});
    }
  }
  const std::vector<uint32_t>& cells = quads.empty() ? play.triangles : quads;
  nv::cloth::ClothMeshDesc mesh;
  mesh.points.data = play.rest.data();
  mesh.points.stride = sizeof(PxVec4);
  mesh.points.count = static_cast<uint32_t>(play.rest.size());
  mesh.invMasses.data = &play.rest[0].w;
  mesh.invMasses.stride = sizeof(PxVec4);
  mesh.invMasses.count = mesh.points.count;
  auto& list = quads.empty() ? mesh.triangles : mesh.quads;
  const uint32_t corners = quads.empty() ? 3 : 4;
  list.data = cells.data();
  list.stride = corners * sizeof(uint32_t);
  list.count = static_cast<uint32_t>(cells.size() / corners);
  return NvClothCookFabricFromMesh(factory, mesh, PxVec3(0, 0, 1), nullptr, true);
}

template <class T>
nv::cloth::Range<const T> RangeOf(const std::vector<T>& values) {
  return {values.data(), values.data() + values.size()};
}

nv::cloth::Cloth* MakeCloth(nv::cloth::Factory* factory, nv::cloth::Fabric& fabric,
                            const Play& play, int iterations, float distance_m) {
  nv::cloth::Cloth* cloth = factory->createCloth(RangeOf(play.start), fabric);
  std::vector<nv::cloth::PhaseConfig> phases;
  for (uint32_t phase = 0; phase < fabric.getNumPhases(); ++phase) {
    phases.emplace_back(static_cast<uint16_t>(phase));
  }
  cloth->setPhaseConfig(RangeOf(phases));
  cloth->setGravity(PxVec3(0, -9.81f, 0));
  cloth->setDamping(PxVec3(0.0f));
  cloth->setLinearDrag(PxVec3(0.0f));
  cloth->setAngularDrag(PxVec3(0.0f));
  cloth->setDragCoefficient(0);
  cloth->setLiftCoefficient(0);
  cloth->setSolverFrequency(static_cast<float>(iterations) / kFrame_s);
  cloth->setStiffnessFrequency(1 / kFrame_s);
  cloth->setFriction(kFriction);
  cloth->setRestPositions(RangeOf(play.rest));
  cloth->setSelfCollisionDistance(distance_m);
  cloth->setSelfCollisionStiffness(distance_m > 0 ? 1.0f : 0.0f);
  return cloth;
}

void Place(nv::cloth::Cloth& cloth, const Frame& frame) {
  cloth.setPlanes(RangeOf(frame.planes), 0, cloth.getNumPlanes());
  std::vector<uint32_t> masks;
  for (size_t k = 0; k < frame.planes.size(); ++k) masks.push_back(1u << k);
  cloth.setConvexes(RangeOf(masks), 0, cloth.getNumConvexes());
  cloth.setSpheres(RangeOf(frame.spheres), 0, cloth.getNumSpheres());
  if (frame.targets.empty()) return;
  const nv::cloth::MappedRange<PxVec4> particles = cloth.getCurrentParticles();
  for (const auto& [i, place_m] : frame.targets) particles[i] = PxVec4(place_m, 0);
}

double ThreadTime_ms() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

void Write(const nv::cloth::Cloth& cloth, std::ofstream& file) {
  const nv::cloth::MappedRange<const PxVec4> particles = cloth.getCurrentParticles();
  for (const PxVec4& p : particles)
    file.write(reinterpret_cast<const char*>(&p.x), 3 * sizeof(float));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "Usage: nvcloth_contact PLAY POSITIONS ITERATIONS DISTANCE_M\n");
    return 2;
  }
  static Allocator allocator;
  static Errors errors;
  static Asserts asserts;
  nv::cloth::InitializeNvCloth(&allocator, &errors, &asserts, nullptr);
  nv::cloth::Factory* factory = NvClothCreateFactoryCPU();
  const Play play = ReadPlay(argv[1]);
  nv::cloth::Fabric* fabric = Cook(factory, play);
  nv::cloth::Solver* solver = factory->createSolver();
  nv::cloth::Cloth* cloth =
      MakeCloth(factory, *fabric, play, std::atoi(argv[3]), static_cast<float>(std::atof(argv[4])));
  solver->addCloth(cloth);
  std::ofstream file(argv[2], std::ios::binary);
  double sum_ms = 0, worst_ms = 0;
  for (const Frame& frame : play.frames) {
    Place(*cloth, frame);
    const double start_ms = ThreadTime_ms();
    solver->beginSimulation(kFrame_s);
    for (int chunk = 0; chunk < solver->getSimulationChunkCount(); ++chunk) {
      solver->simulateChunk(chunk);
    }
    solver->endSimulation();
    const double took_ms = ThreadTime_ms() - start_ms;
    sum_ms += took_ms;
    worst_ms = std::max(worst_ms, took_ms);
    Write(*cloth, file);
  }
  std::printf("%.6g %.6g\n", sum_ms / static_cast<double>(play.frames.size()), worst_ms);
  solver->removeCloth(cloth);
  NV_CLOTH_DELETE(cloth);
  NV_CLOTH_DELETE(solver);
  fabric->decRefCount();
  NvClothDestroyFactory(factory);
}
