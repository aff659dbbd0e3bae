// The threads that step one big cloth together.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace drape::cpu {

// Cloths with fewer particles are stepped by one thread. Two threads of an AMD EPYC (Zen 5) take a
// REALTIME step of 1024 particles in 0.51 ms instead of 0.69 ms, of 2048 in 0.87 instead of 1.39,
// of 4096 in 1.8 instead of 2.8, of 16384 in 6.5 instead of 11.9 (README.md); but where other
// programs want the cores, a thread put aside can cost a step some milliseconds.
inline constexpr uint32_t kMinTeamParticles = 2048;

// One thread, the leader, steps the cloth and calls AnyOf; others take part in what it calls while
// they are in Join. Nobody waits for a thread that has taken nothing: alone the leader does
// everything, and a thread that the system puts aside holds up only the range that it is in. So it
// does not matter when the others come, nor whether they do.
class StepTeam {
 public:
  // `max_members`: the leader included, at least 1.
  explicit StepTeam(uint32_t max_members);

  uint32_t max_members() const { return static_cast<uint32_t>(seats_.size()); }
  // How many have come so far, the leader included.
  uint32_t member_count() const;

  // By the leader. Divides the indices [begin, end) into ranges of at least `grain` and calls
  // function(range_begin, range_end, member) once for each, side by side; returns when all are
  // done, and whether any call returned true. Members have numbers below max_members; calls of one
  // member never overlap. `function` must not throw.
  template <class Function>
  bool AnyOf(size_t begin, size_t end, size_t grain, const Function& function) {
    const Call call = [](const void* object, size_t range_begin, size_t range_end,
                         uint32_t member) -> bool {
      return (*static_cast<const Function*>(object))(range_begin, range_end, member);
    };
    return Do({call, &function, begin, end, grain});
  }

  // By another thread: takes part until the team is closed. Returns at once where it is closed or
  // has all its members.
  void Join();
  // By the leader, or while it does nothing: those in Join return. Afterwards the leader is alone.
  void Close();
  bool is_closed() const { return stage_.load(std::memory_order_acquire) == kClosed; }

 private:
  using Call = bool (*)(const void* object, size_t begin, size_t end, uint32_t member);
  static constexpr uint32_t kClosed = UINT32_MAX;

  // The work of a stage. Once published `grain` is the size of its ranges.
  struct Work {
    Call call = nullptr;
    const void* object = nullptr;
    size_t begin = 0;
    size_t end = 0;
    size_t grain = 1;
  };

  // Apart from others: each member mostly writes its own.
  struct alignas(128) Seat {
    // Ranges of this seat that nobody has taken: the stage in the upper 32 bits, first and last + 1
    // in 16 bits each. Its owner takes the first, others the last.
    std::atomic<uint64_t> ranges{0};
    // Constant while a range of the stage is not done, and so for whoever has taken one.
    Work work;
  };

  bool Do(const Work& work);
  void Publish(const Work& work, size_t range_count, uint32_t members);
  // Whatever is left of the stage under way.
  void TakeRanges(uint32_t member);
  // Until the seat has another stage than `seen`, which is returned.
  uint32_t AwaitStage(const Seat& seat, uint32_t seen) const;
  void AwaitRanges(size_t range_count) const;

  std::vector<Seat> seats_;  // [max_members]
  alignas(128) std::atomic<uint32_t> next_seat_{1};
  // The number of the stage under way, kClosed; for those who sleep.
  alignas(128) std::atomic<uint32_t> stage_{0};
  alignas(128) std::atomic<size_t> ranges_done_{0};  // of this stage
  std::atomic<bool> any_{false};                     // of this stage
};

// Closes a team when its leader goes, in whatever way. Null: there is none.
struct TeamLead {
  StepTeam* const team;
  ~TeamLead() {
    if (team != nullptr) team->Close();
  }
};

}  // namespace drape::cpu
