#include "server/scheduler/gathering.h"

#include <algorithm>

namespace drape {
namespace {

// Factor by which the duration of the longest recent batch decays with every batch. Slow enough
// that a small batch between large ones does not end the waiting, which would produce more small
// batches.
constexpr double kMemory = 0.9;
// Longest wait, in batches: the device works at least a third of the time.
constexpr double kBatches = 2;

}  // namespace

void Gathering::EndBatch(int64_t batch_us) {
  batch_us_ = std::max(static_cast<double>(batch_us), kMemory * batch_us_);
  delay_us_ = std::min(static_cast<int64_t>(kBatches * batch_us_), max_delay_us_);
}

void Gathering::Count(const Visitor& visitor, bool is_away) {
  const uint32_t change = is_away ? 1 : -1u;  // modulo 2^32
  if (visitor.comes_back) awaited_count_ += change;
  if (visitor.is_quick) quick_count_ += change;
  if (visitor.comes_back && visitor.is_quick) quick_awaited_count_ += change;
}

void Gathering::Arrive(const std::string& session, int64_t now_us) {
  const auto found = sessions_.find(session);
  if (found == sessions_.end() || !found->second.is_away) return;
  Visitor& visitor = found->second;
  Count(visitor, false);
  visitor.is_away = false;
  const int64_t away_us = now_us - visitor.answered_us;
  visitor.comes_back = away_us < delay_us_;
  visitor.is_quick = away_us < spin_us_;
}

void Gathering::Answer(const std::string& session, uint32_t left, int64_t now_us) {
  if (left > 0) return;
  Visitor& visitor = sessions_[session];
  visitor.answered_us = now_us;
  visitor.is_away = true;
  Count(visitor, true);
}

int64_t Gathering::SpinUntil() const {
  if (quick_count_ != 1 || awaited_count_ != quick_awaited_count_) return 0;
  const auto quick = std::find_if(sessions_.begin(), sessions_.end(), [](const auto& entry) {
    return entry.second.is_away && entry.second.is_quick;
  });
  return quick->second.answered_us + spin_us_;
}

bool Gathering::IsOver(Visitor& visitor, int64_t now_us) {
  const int64_t away_us = now_us - visitor.answered_us;
  Count(visitor, false);
  visitor.comes_back &= away_us < delay_us_;
  visitor.is_quick &= away_us < spin_us_;
  Count(visitor, true);
  return away_us >= std::max(delay_us_, spin_us_);
}

std::optional<int64_t> Gathering::WaitUntil(int64_t now_us) {
  std::optional<int64_t> until_us;
  for (auto entry = sessions_.begin(); entry != sessions_.end();) {
    Visitor& visitor = entry->second;
    if (visitor.is_away && IsOver(visitor, now_us)) {
      entry = sessions_.erase(entry);
      continue;
    }
    if (visitor.is_away && visitor.comes_back) {
      const int64_t awaited_until_us = visitor.answered_us + delay_us_;
      until_us = std::max(until_us.value_or(awaited_until_us), awaited_until_us);
    }
    ++entry;
  }
  return until_us;
}

}  // namespace drape
