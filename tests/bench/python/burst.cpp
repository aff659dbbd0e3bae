// burst ADDRESS SIDE CLOTHS CALLS POSITIONS MALLOPT: what client.py measures, by the C++ client: so
// many Step requests of so many sheets of SIDE×SIDE, one cheap sweep each, with positions or
// acknowledged only. Prints one line of JSON: wall times and CPU time.
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "drape/client.h"

namespace {

double CpuS() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

drape::v1::ClothSpec CheapSheet(uint32_t side) {
  drape::v1::ClothSpec spec;
  spec.mutable_grid()->set_columns(side);
  spec.mutable_grid()->set_rows(side);
  spec.mutable_grid()->set_width_m(1);
  spec.mutable_grid()->set_height_m(1);
  spec.add_pins()->set_particle(0);
  spec.add_pins()->set_particle(side - 1);
  spec.mutable_settings()->set_substeps(1);
  spec.mutable_settings()->set_max_iterations(1);
  return spec;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 7) return 2;
  const auto side = static_cast<uint32_t>(std::atoi(argv[2]));
  const auto cloths = static_cast<uint32_t>(std::atoi(argv[3]));
  const int calls = std::atoi(argv[4]);
  const bool has_positions = std::atoi(argv[5]) != 0;
  // By default the library lets the heap keep what answers free.
  if (std::atoi(argv[6]) == 0) setenv("DRAPE_MALLOPT", "0", 1);
  try {
    const drape::Client client = drape::Client::Connect(argv[1]);
    drape::Session session = client.CreateSession();
    const std::vector<drape::ClothId> ids = session.CreateCloths(CheapSheet(side), cloths);
    std::vector<double> wall_ms;
    double cpu_begin_s = 0;
    double sum = 0;  // the states are read
    for (int call = -calls / 10; call < calls; ++call) {
      if (call == 0) cpu_begin_s = CpuS();
      drape::v1::StepRequest request;
      request.set_steps(1);
      request.mutable_cloth_ids()->Add(ids.begin(), ids.end());
      if (has_positions) request.mutable_view()->set_positions(true);
      const auto begin = std::chrono::steady_clock::now();
      const drape::v1::StepResponse response = session.Step(std::move(request));
      if (has_positions) sum += response.states().positions_m().data().back();
      const std::chrono::duration<double, std::milli> took =
          std::chrono::steady_clock::now() - begin;
      if (call >= 0) wall_ms.push_back(took.count());
    }
    std::printf("{\"cpu_ms\": %.6f, \"sum\": %.0f, \"wall_ms\": [",
                1e3 * (CpuS() - cpu_begin_s) / calls, sum);
    for (size_t k = 0; k < wall_ms.size(); ++k)
      std::printf("%s%.6f", k > 0 ? ", " : "", wall_ms[k]);
    std::printf("]}\n");
  } catch (const drape::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
