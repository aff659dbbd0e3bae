// drape watch: follows a session while another client steps it.
#include <algorithm>
#include <cstdio>
#include <limits>
#include <memory>

#include "client/cli/commands.h"
#include "client/cli/options.h"

namespace drape::cli {
namespace {

struct WatchOptions {
  SessionFlags target;
  uint32_t every = 1;
  double max_hz = 0;
  bool has_every_frame = false;
  uint64_t frames = std::numeric_limits<uint64_t>::max();
  bool is_json = false;
};

double Lowest(const States& states) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const ClothState& cloth : states) {
    for (size_t row = 0; row < cloth.particle_count; ++row) {
      lowest = std::min(lowest, cloth.positions_m.At(row, 1));
    }
  }
  return lowest;
}

void Print(const States& frame, bool is_json) {
  uint64_t step = 0;
  for (const ClothState& cloth : frame) step = std::max(step, cloth.step);
  const char* format = is_json
                           ? "{\"frame\": %lu, \"cloths\": %zu, \"step\": %lu, \"lowest_m\": %.9g, "
                             "\"frames_dropped\": %lu}\n"
                           : "frame %lu: %zu cloths, step %lu, lowest %.6g m, %lu frames dropped\n";
  std::printf(format, frame.frame(), frame.size(), step, Lowest(frame), frame.frames_dropped());
  std::fflush(stdout);
}

int Watch(const WatchOptions& options) {
  const Client client = options.target.address.Connect();
  const Session session = options.target.Attach(client);
  v1::StreamStatesRequest::Subscribe subscribe;
  options.target.Select(&subscribe);
  subscribe.set_every_n_steps(options.every);
  subscribe.set_max_hz(options.max_hz);
  if (options.has_every_frame) subscribe.set_delivery(v1::StreamStatesRequest::EVERY_FRAME);
  StateStream stream = session.StreamStates(std::move(subscribe));
  for (uint64_t count = 0; count < options.frames; ++count) {
    const std::optional<States> frame = stream.Next();
    if (!frame) break;
    Print(*frame, options.is_json);
  }
  return kDone;
}

}  // namespace

void AddWatch(CLI::App& app, Action& action) {
  CLI::App* watch = app.add_subcommand("watch", "Follow a session while it is stepped");
  auto options = std::make_shared<WatchOptions>();
  options->target.AddTo(*watch);
  watch->add_option("--every", options->every, "A frame every N steps (default: 1)")
      ->check(CLI::PositiveNumber)
      ->type_name("N");
  auto* max_hz = watch->add_option("--max-hz", options->max_hz,
                                   "Frames per second at most (default: no limit)");
  max_hz->check(CLI::NonNegativeNumber)->check(FiniteNumber())->type_name("HZ");
  watch
      ->add_flag("--every-frame", options->has_every_frame,
                 "Leave no frame out; end with SLOW_CONSUMER when they come too fast")
      ->excludes(max_hz);
  watch->add_option("--frames", options->frames, "End after this many frames")
      ->check(CLI::PositiveNumber)
      ->type_name("N");
  watch->add_flag("--json", options->is_json, "Print a JSON object per line");
  watch->callback([options, &action] { action = [options] { return Watch(*options); }; });
}

}  // namespace drape::cli
