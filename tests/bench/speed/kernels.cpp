// Steps of the cloths whose kernels `./run bench kernels` counts, on the backend gl, one alone and
// many at once, with several folders of shaders in turn -> speed_kernels.csv.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "server/solver/gl_compute/gl_tuning.h"
#include "tests/bench/kernels/named_cloths.h"
#include "tests/bench/quantiles.h"
#include "tests/bench/speed/speed.h"
#include "tests/bench/speed/turns.h"
#include "tests/bench/subcommands.h"
#include "tests/support/backends/backends.h"

namespace drape::bench {
namespace {

struct Taker {
  std::string shaders;
  TurnTaker cloths;
  std::vector<double> ms = {};
};

// Null, with a line of output, where the device refuses.
std::unique_ptr<Backend> MakeBackendWith(const std::string& shaders, const NamedCloth& named) {
  const std::string shader_dir = shaders == KernelTimesOptions::kBuiltIn ? "" : shaders;
  GlTuning tuning;
  if (named.strip_solve != StripSolve::kReduction) tuning.strip_solve = named.strip_solve;
  Result<std::unique_ptr<Backend>> backend =
      CreateTunedGlBackend({.shader_dir = shader_dir}, tuning);
  if (backend.ok()) return std::move(*backend);
  std::printf("    %s: %s\n", shaders.c_str(), backend.status().ToString().c_str());
  return nullptr;
}

std::vector<Taker> MakeTakers(const KernelTimesOptions& options, const NamedCloth& named,
                              const test::Scene& start, uint32_t cloths) {
  std::vector<Taker> takers;
  for (const std::string& shader_dir : options.shader_dirs) {
    std::unique_ptr<Backend> backend = MakeBackendWith(shader_dir, named);
    if (backend) takers.push_back({shader_dir, TurnTaker(std::move(backend), start, cloths)});
  }
  return takers;
}

std::vector<uint32_t> CountsFor(const KernelTimesOptions& options, uint32_t particles,
                                bool is_hardware) {
  if (particles > options.most_particles_of_many) return {1};
  if (!options.counts.empty()) return options.counts;
  return is_hardware ? options.hardware_counts : options.software_counts;
}

// Those of these names; of none: all. std::runtime_error at an unknown name.
std::vector<NamedCloth> WantedCloths(const std::vector<std::string>& names) {
  std::vector<NamedCloth> cloths = NamedCloths();
  std::erase_if(cloths, [](const NamedCloth& cloth) { return cloth.tells_impulses; });
  std::string known;
  for (const NamedCloth& cloth : cloths) known += " " + cloth.name;
  for (const std::string& name : names) {
    if (std::ranges::find(cloths, name, &NamedCloth::name) == cloths.end()) {
      throw std::runtime_error("--cloths: no cloth is called '" + name + "'; there are" + known);
    }
  }
  if (names.empty()) return cloths;
  std::erase_if(cloths, [&](const NamedCloth& cloth) {
    return std::ranges::find(names, cloth.name) == names.end();
  });
  return cloths;
}

}  // namespace

void MeasureKernelTimes(Bench& bench, KernelTimesOptions options) {
  if (bench.is_quick()) {
    options.counts = {1};
    options.rounds = 1;
    options.turn_s = 0.001;
  }
  const bool is_hardware = test::MakeBackend("gl")->Describe().is_hardware_gpu;
  Table table = bench.OpenTable("speed_kernels", {"cloth", "shaders", "cloths", "particles",
                                                  "rounds", "median_ms", "p10_ms", "p90_ms"});
  for (const NamedCloth& named : WantedCloths(options.cloths)) {
    const uint32_t particles = named.scene.model->particle_count();
    const test::Scene start =
        Advance(*bench.fast_backend().backend, named.scene, bench.is_quick() ? 2 : named.steps)
            .scene;
    for (const uint32_t count : CountsFor(options, particles, is_hardware)) {
      if (!bench.StartRow(std::to_string(count) + " x " + named.name)) return;
      std::vector<Taker> takers = MakeTakers(options, named, start, count);
      TakeTurns(takers, options.rounds, options.turn_s);
      for (const Taker& taker : takers) {
        const double median_ms = Quantile(taker.ms, 0.5);
        std::printf("    %-24s %10.3f ms\n", taker.shaders.c_str(), median_ms);
        table.Add({named.name, taker.shaders, count, particles, options.rounds, median_ms,
                   Quantile(taker.ms, 0.1), Quantile(taker.ms, 0.9)});
      }
    }
  }
}

}  // namespace drape::bench
