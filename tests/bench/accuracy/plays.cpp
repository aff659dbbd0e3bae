#include "tests/bench/accuracy/plays.h"

#include <algorithm>
#include <chrono>
#include <memory>

#include "tests/bench/quantiles.h"

namespace drape::bench {
namespace {

constexpr uint32_t kTurnsPerPlay = 10;

// One contestant and what was measured of it.
class Player {
 public:
  Player(Contestant& contestant, const AccuracyScene& scene,
         const std::vector<Eigen::Vector3d>& reference_m)
      : contestant_(contestant), scene_(scene), observer_(scene, reference_m) {}

  void StartRound() {
    contestant_.Restart();
    is_first_ = wall_ms_.empty();
    wall_ms_.push_back(0);
    frame_ = 0;
    if (is_first_) observer_.Observe(0, contestant_.State());
  }

  // Up to frame `until`.
  void Advance(uint32_t until, const PlayLimits& limits) {
    using Clock = std::chrono::steady_clock;
    while (frame_ < until && status_ == "ok") {
      const auto start = Clock::now();
      const FrameReport report = contestant_.Step();
      const std::chrono::duration<double, std::milli> wall = Clock::now() - start;
      wall_ms_.back() += wall.count();
      ++frame_;
      if (!is_first_) continue;
      iterations_ += report.iterations;
      observer_.Observe(frame_, contestant_.State());
      if (report.is_faulted) status_ = "faulted";
    }
    // Expected time of the whole play, from the part played so far.
    const double expected_ms = wall_ms_.back() / std::max(frame_, 1u) * scene_.frame_count();
    if (is_first_ && status_ == "ok" && expected_ms > 1000 * limits.play_s) status_ = "over_time";
  }

  bool WantsRound(const PlayLimits& limits) const {
    double total_ms = 0;
    for (const double wall_ms : wall_ms_) total_ms += wall_ms;
    return wall_ms_.empty() || (status_ == "ok" && wall_ms_.size() <= limits.repeats &&
                                total_ms < 1000 * limits.seconds);
  }

  PlayResult Result() const {
    PlayResult result;
    result.status = status_;
    result.deviations = status_ == "ok" ? observer_.Result() : Deviations::NotDefined();
    std::span<const double> wall_ms(wall_ms_);
    if (wall_ms.size() > 1) wall_ms = wall_ms.subspan(1);
    // Only a play that was stopped early has less than all frames; then there is no other.
    const uint32_t frames = wall_ms_.size() > 1 ? scene_.frame_count() : frame_;
    const double played_s = frames * kFrame_s;
    result.repeats = static_cast<uint32_t>(wall_ms.size());
    result.wall_ms_per_s = Quantile(wall_ms, 0.5) / played_s;
    result.wall_min_ms_per_s = Quantile(wall_ms, 0) / played_s;
    result.wall_max_ms_per_s = Quantile(wall_ms, 1) / played_s;
    result.iterations_per_frame = iterations_ / frames;
    return result;
  }

 private:
  Contestant& contestant_;
  const AccuracyScene& scene_;
  Observer observer_;
  std::string status_ = "ok";
  std::vector<double> wall_ms_;  // of each play
  double iterations_ = 0;        // of the first play
  uint32_t frame_ = 0;
  bool is_first_ = true;
};

}  // namespace

std::vector<PlayResult> PlaySideBySide(std::span<Entry> entries, const AccuracyScene& scene,
                                       const std::vector<Eigen::Vector3d>& reference_m,
                                       const PlayLimits& limits) {
  std::vector<std::unique_ptr<Player>> players;
  for (Entry& entry : entries) {
    players.push_back(std::make_unique<Player>(*entry.contestant, scene, reference_m));
  }
  for (;;) {
    std::vector<Player*> round;
    for (const auto& player : players) {
      if (player->WantsRound(limits)) round.push_back(player.get());
    }
    if (round.empty()) break;
    for (Player* player : round) player->StartRound();
    for (uint32_t turn = 1; turn <= kTurnsPerPlay; ++turn) {
      for (Player* player : round) {
        player->Advance(scene.frame_count() * turn / kTurnsPerPlay, limits);
      }
    }
  }
  std::vector<PlayResult> results;
  for (const auto& player : players) results.push_back(player->Result());
  return results;
}

}  // namespace drape::bench
