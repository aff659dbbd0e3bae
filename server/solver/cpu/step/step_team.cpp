#include "server/solver/cpu/step/step_team.h"

#include <algorithm>
#include <thread>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace drape::cpu {
namespace {

// With one range per member the slowest thread would hold up all; more cost more than they even
// out.
constexpr size_t kRangesPerMember = 4;
constexpr size_t kMaxRanges = UINT16_MAX;
// How often a thread looks before it gives its core to others: for some 50 us, which is longer
// than stages are apart and shorter than it takes to wake a thread twice.
constexpr int kLooks = 2000;

void Pause() {
#if defined(__x86_64__)
  _mm_pause();
#endif
}

uint64_t Pack(uint32_t stage, size_t first, size_t end) {
  return uint64_t{stage} << 32 | uint64_t{first} << 16 | uint64_t{end};
}
uint32_t StageOf(uint64_t ranges) {
  return static_cast<uint32_t>(ranges >> 32);
}
uint32_t FirstOf(uint64_t ranges) {
  return static_cast<uint32_t>(ranges >> 16 & 0xffff);
}
uint32_t EndOf(uint64_t ranges) {
  return static_cast<uint32_t>(ranges & 0xffff);
}

constexpr uint32_t kNoRange = UINT32_MAX;

uint32_t TakeRange(std::atomic<uint64_t>& ranges, bool is_own) {
  uint64_t now = ranges.load(std::memory_order_acquire);
  while (FirstOf(now) < EndOf(now)) {
    const uint64_t rest = is_own ? Pack(StageOf(now), FirstOf(now) + 1, EndOf(now))
                                 : Pack(StageOf(now), FirstOf(now), EndOf(now) - 1);
    if (ranges.compare_exchange_weak(now, rest, std::memory_order_acq_rel,
                                     std::memory_order_acquire)) {
      return is_own ? FirstOf(now) : EndOf(now) - 1;
    }
  }
  return kNoRange;
}

}  // namespace

StepTeam::StepTeam(uint32_t max_members) : seats_(max_members) {}

uint32_t StepTeam::member_count() const {
  return std::min(next_seat_.load(std::memory_order_acquire), max_members());
}

bool StepTeam::Do(const Work& work) {
  const size_t count = work.end - work.begin;
  const uint32_t members = member_count();
  const size_t most = std::min(members * kRangesPerMember, kMaxRanges);
  const size_t range_count = std::min((count + work.grain - 1) / work.grain, most);
  if (members == 1 || range_count < 2 || is_closed()) {
    return count > 0 && work.call(work.object, work.begin, work.end, 0);
  }
  const size_t range_size = (count + range_count - 1) / range_count;
  any_.store(false, std::memory_order_relaxed);
  Publish({work.call, work.object, work.begin, work.end, range_size},
          (count + range_size - 1) / range_size, members);
  return any_.load(std::memory_order_relaxed);
}

void StepTeam::Publish(const Work& work, size_t range_count, uint32_t members) {
  const uint32_t stage = stage_.load(std::memory_order_relaxed) + 1;
  ranges_done_.store(0, std::memory_order_relaxed);
  for (uint32_t k = 0; k < members; ++k) {
    seats_[k].work = work;
    seats_[k].ranges.store(Pack(stage, range_count * k / members, range_count * (k + 1) / members),
                           std::memory_order_release);
  }
  stage_.store(stage);
  stage_.notify_all();
  TakeRanges(0);
  AwaitRanges(range_count);
}

void StepTeam::TakeRanges(uint32_t member) {
  const uint32_t members = member_count();
  size_t done = 0;
  bool any = false;
  for (uint32_t k = 0; k < members; ++k) {
    Seat& seat = seats_[(member + k) % members];
    for (;;) {
      const uint32_t range = TakeRange(seat.ranges, k == 0);
      if (range == kNoRange) break;
      const Work& work = seat.work;
      const size_t begin = work.begin + range * work.grain;
      any |= work.call(work.object, begin, std::min(begin + work.grain, work.end), member);
      ++done;
    }
  }
  if (any) any_.store(true, std::memory_order_relaxed);
  if (done > 0) ranges_done_.fetch_add(done, std::memory_order_acq_rel);
}

void StepTeam::AwaitRanges(size_t range_count) const {
  for (int look = 0; ranges_done_.load(std::memory_order_acquire) < range_count; ++look) {
    // Whoever has not done its range has been put aside by the system.
    if (look < kLooks) {
      Pause();
    } else {
      std::this_thread::yield();
    }
  }
}

uint32_t StepTeam::AwaitStage(const Seat& seat, uint32_t seen) const {
  const auto now = [&] { return StageOf(seat.ranges.load(std::memory_order_acquire)); };
  for (int look = 0; look < kLooks; ++look) {
    if (now() != seen) return now();
    Pause();
  }
  for (;;) {
    // Before the seat: a stage that is published after this is not slept through.
    const uint32_t published = stage_.load();
    if (now() != seen) return now();
    stage_.wait(published);
  }
}

void StepTeam::Join() {
  if (member_count() == max_members()) return;
  const uint32_t member = next_seat_.fetch_add(1, std::memory_order_acq_rel);
  if (member >= max_members()) return;
  uint32_t seen = 0;
  while ((seen = AwaitStage(seats_[member], seen)) != kClosed) TakeRanges(member);
}

void StepTeam::Close() {
  for (Seat& seat : seats_) seat.ranges.store(Pack(kClosed, 0, 0), std::memory_order_release);
  stage_.store(kClosed);
  stage_.notify_all();
}

}  // namespace drape::cpu
