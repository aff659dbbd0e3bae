// Steps of the cloths whose kernels `./run bench kernels` counts, on the backend gl, one alone and
// many at once, with several folders of shaders in turn -> speed_kernels.csv.
#include <algorithm>
#include <cstdio>
#include <memory>
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
  for (const NamedCloth& named : NamedCloths()) {
    const bool is_wanted = options.cloths.empty() ||
                           std::ranges::find(options.cloths, named.name) != options.cloths.end();
    if (named.tells_impulses || !is_wanted) continue;
    const uint32_t particles = named.scene.model->particle_count();
    const test::Scene start =
        Advance(*bench.fast_backend().backend, named.scene, bench.is_quick() ? 2 : named.steps)
            .scene;
    for (const uint32_t count : CountsFor(options, particles, is_hardware)) {
      if (!bench.StartRow(std::to_string(count) + " x " + named.name)) return;
      std::vector<Taker> takers = MakeTakers(options, named, start, count);
      for (uint32_t round = 0; round <= options.rounds; ++round) {
        for (Taker& taker : takers) {
          const double ms = taker.cloths.Turn_ms(options.turn_s);
          if (round > 0) taker.ms.push_back(ms);  // the first one warms up
        }
      }
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
