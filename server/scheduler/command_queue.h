// Commands for the device thread, by their owners.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <optional>
#include <string>
#include <unordered_map>

namespace drape {

class Backend;

// Runs on the device thread between two rounds. Must not block.
using DeviceCommand = std::function<void(Backend&)>;

// Those of one owner in order; owners take turns, and may have to rest. Used under a lock of its
// user.
class CommandQueue {
 public:
  struct Entry {
    std::string owner;  // empty: the server itself, which never rests
    DeviceCommand command;
  };

  void Push(const std::string& owner, DeviceCommand command);
  // Goes on with what that owner has begun, whose last command has just been popped: before all
  // others of the owner.
  void PushNext(const std::string& owner, DeviceCommand command);
  // Before all others of that owner, but after what it has begun.
  void PushFirst(const std::string& owner, DeviceCommand command);
  // What is pushed from now on waits for the next round: a slice of long work for the steps after
  // the one before.
  void BeginRound() { ++round_; }
  // The next command of this round, of an owner that does not rest at `now_us`, if there is one.
  std::optional<Entry> Pop(int64_t now_us);
  // No command of that owner is popped before `until_us`.
  void Rest(const std::string& owner, int64_t now_us, int64_t until_us);
  // Nobody rests any longer.
  void EndRests();
  // When the next command may be popped, at the earliest: none if there are no commands.
  std::optional<int64_t> ReadyAt_us() const;

  bool empty() const { return size_ == 0; }
  size_t size() const { return size_; }
  size_t size_of(const std::string& owner) const;

 private:
  struct Waiting {
    uint64_t round = 0;  // in which it was pushed
    DeviceCommand command;
    bool goes_on = false;  // PushNext
  };
  struct Owner {
    std::deque<Waiting> commands{};
    int64_t rests_until_us = 0;
  };

  Owner& OwnerWithCommands(const std::string& owner);

  uint64_t round_ = 0;
  size_t size_ = 0;
  std::unordered_map<std::string, Owner> owners_;  // with commands, or resting
  std::list<std::string> turns_;                   // of those with commands
};

}  // namespace drape
