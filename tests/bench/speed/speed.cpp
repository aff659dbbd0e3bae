#include "tests/bench/speed/speed.h"

#include <algorithm>

namespace drape::bench {

void MeasureSpeed(Bench& bench, const SpeedOptions& options) {
  const auto is_wanted = [&](const char* part) {
    return std::ranges::find(options.parts, part) != options.parts.end();
  };
  if (is_wanted("limits")) MeasureLimits(bench, options.limits);
  if (is_wanted("cost")) MeasureCost(bench, options.cost);
  if (is_wanted("flatness")) MeasureFlatness(bench, options.flatness);
  if (is_wanted("unlike")) MeasureUnlike(bench, options.unlike);
  if (is_wanted("fabrics")) MeasureFabrics(bench, options.fabrics);
  if (is_wanted("skips")) MeasureSkips(bench, options.skips);
  if (is_wanted("service")) MeasureService(bench, options.service);
  if (is_wanted("curve")) MeasureCurve(bench, options.curve);
  if (is_wanted("local_sizes")) MeasureLocalSizes(bench, options.local_sizes);
  if (is_wanted("kernels")) MeasureKernelTimes(bench, options.kernels);
}

}  // namespace drape::bench
