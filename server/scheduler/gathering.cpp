#include "server/scheduler/gathering.h"

#include <algorithm>

namespace drape {
namespace {

// How much of the time of the longest batch lately is left after another one. Slowly enough that
// single small batches between large ones do not end the waiting, by which they would become more.
constexpr double kMemory = 0.9;
// Longest wait, in batches: the device works at least a third of the time.
constexpr double kBatches = 2;

}  // namespace

void Gathering::EndBatch(int64_t batch_us) {
  batch_us_ = std::max(static_cast<double>(batch_us), kMemory * batch_us_);
  delay_us_ = std::min(static_cast<int64_t>(kBatches * batch_us_), max_delay_us_);
}

void Gathering::Arrive(const std::string& tenant, int64_t now_us) {
  const auto found = clients_.find(tenant);
  if (found == clients_.end() || !found->second.is_away) return;
  Client& client = found->second;
  awaited_count_ -= client.comes_back;
  client.is_away = false;
  const int64_t away_us = now_us - client.answered_us;
  client.comes_back = away_us < delay_us_;
  client.is_quick = away_us < kLook_us;
}

void Gathering::Answer(const std::string& tenant, uint32_t left, int64_t now_us) {
  if (left > 0) return;
  Client& client = clients_[tenant];
  client.answered_us = now_us;
  client.is_away = true;
  awaited_count_ += client.comes_back;
}

int64_t Gathering::LookUntil() const {
  if (awaited_count_ != 1) return 0;
  const auto awaited = std::find_if(clients_.begin(), clients_.end(), [](const auto& entry) {
    return entry.second.is_away && entry.second.comes_back;
  });
  const Client& client = awaited->second;
  return client.is_quick ? client.answered_us + std::min(kLook_us, delay_us_) : 0;
}

std::optional<int64_t> Gathering::WaitUntil(int64_t now_us) {
  std::optional<int64_t> until_us;
  for (auto entry = clients_.begin(); entry != clients_.end();) {
    const Client& client = entry->second;
    const int64_t awaited_until_us = client.answered_us + delay_us_;
    if (client.is_away && awaited_until_us <= now_us) {
      awaited_count_ -= client.comes_back;
      entry = clients_.erase(entry);
      continue;
    }
    if (client.is_away && client.comes_back) {
      until_us = std::max(until_us.value_or(awaited_until_us), awaited_until_us);
    }
    ++entry;
  }
  return until_us;
}

}  // namespace drape
