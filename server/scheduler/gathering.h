// How long a batch waits for clients that are about to ask again.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>

namespace drape {

// Clients that ask for one step after the other get their answers together and come back one by
// one: if the first one were stepped at once, alone, the others would be a batch of their own after
// it. So a batch waits for them, if they have shown that they come back soon. Times are those of
// one clock [us]. Not thread-safe.
class Gathering {
 public:
  // Nobody is waited for longer than `max_delay_us` after its answer; 0: nobody at all.
  explicit Gathering(int64_t max_delay_us) : max_delay_us_(max_delay_us) {}

  // A batch took that long. Nobody is waited for longer than twice the time of the longest batch
  // lately.
  void EndBatch(int64_t batch_us);

  // A tenant submitted a request.
  void Arrive(const std::string& tenant, int64_t now_us);
  // A request of the tenant is answered; `left` others are under way.
  void Answer(const std::string& tenant, uint32_t left, int64_t now_us);

  // Tenants that came back soon after the answer before the last one, and have not come back after
  // the last one. What WaitUntil said may have passed.
  uint32_t awaited_count() const { return awaited_count_; }
  // When to begin the next batch without those who are awaited; nothing: nobody is. Who has not
  // come back in time is forgotten, and has to show anew that it comes back.
  std::optional<int64_t> WaitUntil(int64_t now_us);
  // If one tenant alone is awaited, which last time came back within kLook_us: until when it is to
  // be looked for, rather than slept for. Else 0. Waking a thread takes 25 us and more, on a core
  // that has fallen idle; in a loop of single steps that is a part of every step.
  int64_t LookUntil() const;

  // Nobody is looked for longer after its answer [us].
  static constexpr int64_t kLook_us = 500;

 private:
  struct Client {
    int64_t answered_us = 0;
    bool is_away = false;     // all its requests are answered
    bool comes_back = false;  // it did last time, in time
    bool is_quick = false;    // it did within kLook_us
  };

  const int64_t max_delay_us_;
  double batch_us_ = 0;  // of the longest lately
  int64_t delay_us_ = 0;
  std::unordered_map<std::string, Client> clients_;
  uint32_t awaited_count_ = 0;
};

}  // namespace drape
