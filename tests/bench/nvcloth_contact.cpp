// The scenes of contact/contact_scenes.cpp that start as a sheet, with NvCloth and its
// self-collision, which keeps spheres around all particles apart; built and run by
// nvcloth_contact.py, no part of the CMake build. Usage: nvcloth_contact SCENE SIDE ITERATIONS
// DISTANCE_M POSITIONS; DISTANCE_M 0: without self-collision. Writes the positions after each frame
// as float[particles][3], and prints the milliseconds of each frame.
#include <time.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "nvcloth_host.h"

namespace {

using namespace nvcloth_host;

constexpr float kFriction = 0.3f;

struct Scene {
  double turn_rad = 0;  // about x
  double lift_m = 0;
  bool has_floor = true, has_ball = false, is_pinned = false;
  int ball_vanishes = -1;  // frame
  int frames = 120;
};

Scene SceneOf(const std::string& name) {
  if (name == "fold") return {.turn_rad = 1.52, .lift_m = 1.05};
  if (name == "drape") return {.lift_m = 0.68, .has_ball = true};
  if (name == "pile") return {.lift_m = 0.68, .has_ball = true, .ball_vanishes = 45, .frames = 150};
  if (name == "swing") return {.has_floor = false, .is_pinned = true};
  std::fprintf(stderr, "nvcloth_contact: no scene %s (fold, drape, pile, swing)\n", name.c_str());
  std::exit(2);
}

std::vector<PxVec4> Particles(const Scene& scene, uint32_t side) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> noise(-1e-4, 1e-4);
  std::vector<PxVec4> particles;
  const double cell_m = 1.0 / (side - 1), c = std::cos(scene.turn_rad),
               s = std::sin(scene.turn_rad);
  for (uint32_t row = 0; row < side; ++row) {
    for (uint32_t column = 0; column < side; ++column) {
      const double z = row * cell_m;
      double shaken[3] = {column * cell_m, -s * z + scene.lift_m, c * z};
      for (double& x : shaken) x += scene.is_pinned ? 0 : noise(random);
      particles.emplace_back(float(shaken[0]), float(shaken[1]), float(shaken[2]), 1.0f);
    }
  }
  if (scene.is_pinned) particles[0].w = particles[side - 1].w = 0;
  return particles;
}

template <class T>
nv::cloth::Range<const T> RangeOf(const std::vector<T>& values) {
  return {values.data(), values.data() + values.size()};
}

nv::cloth::Cloth* MakeCloth(nv::cloth::Factory* factory, nv::cloth::Fabric& fabric,
                            const std::vector<PxVec4>& particles, const Scene& scene,
                            int iterations, float distance_m) {
  nv::cloth::Cloth* cloth = nvcloth_host::MakeCloth(factory, fabric, particles, iterations);
  cloth->setGravity(PxVec3(0, -9.81f, 0));
  cloth->setFriction(kFriction);
  if (scene.has_floor) {
    cloth->setPlanes(RangeOf(std::vector<PxVec4>{PxVec4(0, 1, 0, 0)}), 0, 0);
    cloth->setConvexes(RangeOf(std::vector<uint32_t>{1}), 0, 0);
  }
  if (scene.has_ball) {
    cloth->setSpheres(RangeOf(std::vector<PxVec4>{PxVec4(0.52f, 0.5f, 0.49f, 0.15f)}), 0, 0);
  }
  if (distance_m > 0) {
    cloth->setSelfCollisionDistance(distance_m);
    cloth->setSelfCollisionStiffness(1);
  }
  return cloth;
}

double ThreadTime_ms() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

void Write(const nv::cloth::Cloth& cloth, std::FILE* file) {
  const nv::cloth::MappedRange<const PxVec4> particles = cloth.getCurrentParticles();
  for (uint32_t i = 0; i < particles.size(); ++i)
    std::fwrite(&particles[i].x, sizeof(float), 3, file);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6) {
    std::fprintf(stderr, "Usage: nvcloth_contact SCENE SIDE ITERATIONS DISTANCE_M POSITIONS\n");
    return 2;
  }
  nv::cloth::Factory* factory = MakeFactory();
  const Scene scene = SceneOf(argv[1]);
  const auto side = static_cast<uint32_t>(std::atoi(argv[2]));
  const std::vector<PxVec4> particles = Particles(scene, side);
  nv::cloth::Fabric* fabric = Cook(factory, particles, side);
  nv::cloth::Cloth* cloth = MakeCloth(factory, *fabric, particles, scene, std::atoi(argv[3]),
                                      static_cast<float>(std::atof(argv[4])));
  nv::cloth::Solver* solver = factory->createSolver();
  solver->addCloth(cloth);
  std::FILE* file = std::fopen(argv[5], "wb");
  if (file == nullptr) {
    std::perror(argv[5]);
    return 1;
  }
  for (int frame = 0; frame < scene.frames; ++frame) {
    if (frame == scene.ball_vanishes) {
      cloth->setSpheres(nv::cloth::Range<const PxVec4>(), 0, cloth->getNumSpheres());
    }
    const double start_ms = ThreadTime_ms();
    Simulate(*solver);
    std::printf("%.6g\n", ThreadTime_ms() - start_ms);
    Write(*cloth, file);
  }
  std::fclose(file);
  solver->removeCloth(cloth);
  NV_CLOTH_DELETE(cloth);
  NV_CLOTH_DELETE(solver);
  fabric->decRefCount();
  NvClothDestroyFactory(factory);
}
