// The hanging sheets of the curve with NvCloth; built and run by nvcloth.py, no part of the CMake
// build. Usage: nvcloth_sheets CLOTHS SECONDS ROW..., a row being an iteration count behind t
// (tethers) or n (none).

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string>
#include <vector>

#include "nvcloth_host.h"

namespace {

using namespace nvcloth_host;

constexpr uint32_t kSide = 32;
constexpr float kEdge_m = 1.0f / (kSide - 1);
constexpr int kWindowFrames = 60;

struct Row {
  bool has_tethers;
  int iterations;
};

// Rest positions, and inverse masses as w: two corners of the first row are held.
std::vector<PxVec4> Particles() {
  std::vector<PxVec4> particles;
  for (uint32_t row = 0; row < kSide; ++row) {
    for (uint32_t column = 0; column < kSide; ++column) {
      particles.emplace_back(column * kEdge_m, 0.0f, row * kEdge_m, 1.0f);
    }
  }
  particles[0].w = particles[kSide - 1].w = 0;
  return particles;
}

// Cloth k of `count`, under the gravity of MakeBatch (timing.cpp); one alone: straight down.
nv::cloth::Cloth* MakeCloth(nv::cloth::Factory* factory, nv::cloth::Fabric& fabric,
                            const std::vector<PxVec4>& particles, Row row, int k, int count) {
  nv::cloth::Cloth* cloth = nvcloth_host::MakeCloth(factory, fabric, particles, row.iterations);
  const double turn = std::numbers::pi * (3 - std::sqrt(5.0)) * k;
  const double tilt = count == 1 ? 0 : 10 * std::numbers::pi / 180 * std::sqrt((k + 0.5) / count);
  cloth->setGravity(9.81f * PxVec3(static_cast<float>(std::sin(tilt) * std::cos(turn)),
                                   static_cast<float>(-std::cos(tilt)),
                                   static_cast<float>(std::sin(tilt) * std::sin(turn))));
  cloth->setTetherConstraintScale(1);
  cloth->setTetherConstraintStiffness(row.has_tethers ? 1 : 0);
  return cloth;
}

struct Strains {
  double max = 0;
  double sum_sq = 0;
  uint64_t count = 0;

  void Add(const PxVec4& from, const PxVec4& to) {
    const double length_m = (to.getXYZ() - from.getXYZ()).magnitude();
    const double strain = std::abs(length_m - kEdge_m) / kEdge_m;
    max = strain <= max ? max : strain;  // a NaN stays
    sum_sq += strain * strain;
    ++count;
  }
  // Edges along rows and columns.
  void AddCloth(const nv::cloth::Cloth& cloth) {
    const nv::cloth::MappedRange<const PxVec4> particles = cloth.getCurrentParticles();
    for (uint32_t i = 0; i < particles.size(); ++i) {
      if (i % kSide + 1 < kSide) Add(particles[i], particles[i + 1]);
      if (i + kSide < particles.size()) Add(particles[i], particles[i + kSide]);
    }
  }
};

// Prints microseconds per cloth and frame (mean over the frames), max and RMS strain of the last
// second.
void Play(nv::cloth::Factory* factory, Row row, int count, int frames) {
  const std::vector<PxVec4> particles = Particles();
  nv::cloth::Fabric* fabric = Cook(factory, particles, kSide);
  nv::cloth::Solver* solver = factory->createSolver();
  std::vector<nv::cloth::Cloth*> cloths;
  for (int k = 0; k < count; ++k) {
    cloths.push_back(MakeCloth(factory, *fabric, particles, row, k, count));
    solver->addCloth(cloths.back());
  }
  Strains strains;
  double took_us = 0;
  for (int frame = 1; frame <= frames; ++frame) {
    const auto start = std::chrono::steady_clock::now();
    Simulate(*solver);
    const auto end = std::chrono::steady_clock::now();
    took_us += std::chrono::duration<double, std::micro>(end - start).count();
    if (frame <= frames - kWindowFrames) continue;
    for (const nv::cloth::Cloth* cloth : cloths) strains.AddCloth(*cloth);
  }
  std::printf("%d %d %d %.6g %.6g %.6g\n", row.has_tethers, row.iterations, count,
              took_us / frames / count, strains.max,
              std::sqrt(strains.sum_sq / static_cast<double>(strains.count)));
  std::fflush(stdout);
  for (nv::cloth::Cloth* cloth : cloths) {
    solver->removeCloth(cloth);
    NV_CLOTH_DELETE(cloth);
  }
  NV_CLOTH_DELETE(solver);
  fabric->decRefCount();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "Usage: nvcloth_sheets CLOTHS SECONDS ROW... (t5 n20 ...)\n");
    return 2;
  }
  nv::cloth::Factory* factory = MakeFactory();
  const int count = std::atoi(argv[1]);
  const int frames = static_cast<int>(std::lround(std::atof(argv[2]) / kFrame_s));
  for (int k = 3; k < argc; ++k) {
    Play(factory, {argv[k][0] == 't', std::atoi(argv[k] + 1)}, count, frames);
  }
  NvClothDestroyFactory(factory);
}
