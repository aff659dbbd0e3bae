#include "server/scheduler/session_index.h"

namespace drape {

uint32_t SessionIndex::Enter(const std::string& session) {
  auto [entry, is_new] = entries_.try_emplace(session);
  if (is_new && !free_.empty()) {
    entry->second.index = free_.back();
    free_.pop_back();
  } else if (is_new) {
    entry->second.index = static_cast<uint32_t>(entries_.size() - 1);
  }
  ++entry->second.requests;
  return entry->second.index;
}

void SessionIndex::Leave(const std::string& session) {
  const auto entry = entries_.find(session);
  if (--entry->second.requests > 0) return;
  free_.push_back(entry->second.index);
  entries_.erase(entry);
}

}  // namespace drape
