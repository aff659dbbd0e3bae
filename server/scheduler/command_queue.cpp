#include "server/scheduler/command_queue.h"

#include <algorithm>
#include <utility>

namespace drape {

// A command of it is about to be added.
CommandQueue::Owner& CommandQueue::OwnerWithCommands(const std::string& owner) {
  Owner& its = owners_[owner];
  if (its.commands.empty()) turns_.push_back(owner);
  ++size_;
  return its;
}

void CommandQueue::Push(const std::string& owner, DeviceCommand command) {
  OwnerWithCommands(owner).commands.push_back({round_, std::move(command)});
}

void CommandQueue::PushNext(const std::string& owner, DeviceCommand command) {
  OwnerWithCommands(owner).commands.push_front({round_, std::move(command), true});
}

void CommandQueue::PushFirst(const std::string& owner, DeviceCommand command) {
  std::deque<Waiting>& commands = OwnerWithCommands(owner).commands;
  const bool is_under_way = !commands.empty() && commands.front().goes_on;
  commands.insert(commands.begin() + (is_under_way ? 1 : 0), {round_, std::move(command)});
}

std::optional<CommandQueue::Entry> CommandQueue::Pop(int64_t now_us) {
  for (auto turn = turns_.begin(); turn != turns_.end(); ++turn) {
    const auto its = owners_.find(*turn);
    auto& [owner, queue] = *its;
    if (queue.commands.front().round >= round_ || queue.rests_until_us > now_us) continue;
    Entry entry{owner, std::move(queue.commands.front().command)};
    queue.commands.pop_front();
    --size_;
    if (queue.commands.empty()) {
      turns_.erase(turn);
      owners_.erase(its);
    } else {
      turns_.splice(turns_.end(), turns_, turn);
    }
    return entry;
  }
  return std::nullopt;
}

void CommandQueue::Rest(const std::string& owner, int64_t now_us, int64_t until_us) {
  std::erase_if(owners_, [&](const auto& entry) {
    return entry.second.commands.empty() && entry.second.rests_until_us <= now_us;
  });
  owners_[owner].rests_until_us = until_us;
}

void CommandQueue::EndRests() {
  for (auto& [owner, its] : owners_) its.rests_until_us = 0;
  std::erase_if(owners_, [](const auto& entry) { return entry.second.commands.empty(); });
}

std::optional<int64_t> CommandQueue::ReadyAt_us() const {
  std::optional<int64_t> ready_us;
  for (const std::string& owner : turns_) {
    const int64_t its_us = owners_.at(owner).rests_until_us;
    ready_us = std::min(ready_us.value_or(its_us), its_us);
  }
  return ready_us;
}

size_t CommandQueue::size_of(const std::string& owner) const {
  const auto its = owners_.find(owner);
  return its == owners_.end() ? 0 : its->second.commands.size();
}

}  // namespace drape
