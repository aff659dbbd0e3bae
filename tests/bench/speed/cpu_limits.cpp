#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/bench/speed/cpu_limits.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "tests/bench/speed/cpu_limits.h"

HWY_BEFORE_NAMESPACE();
namespace drape::bench::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// As the lanes of server/solver/cpu.
using Tag = hn::CappedTag<float, 16>;
using Numbers = hn::Vec<Tag>;

// Enough independent chains to hide the latency of any of the operations.
constexpr size_t kChains = 12;

// The compiler cannot know that nobody reads what was written.
inline void MustBeDone(float* written) {
  asm volatile("" : : "r"(written) : "memory");
}

void Copy(const float* from, float* to, size_t count, size_t rounds) {
  const Tag tag;
  const size_t lanes = hn::Lanes(tag);
  for (size_t round = 0; round < rounds; ++round) {
    for (size_t k = 0; k < count; k += lanes) hn::Store(hn::Load(tag, from + k), tag, to + k);
    MustBeDone(to);
  }
}

// `rounds` times `step` on every chain; writes the result to `out`, [lanes] floats.
template <class Step>
void Repeat(size_t rounds, float* out, const Step& step) {
  const Tag tag;
  Numbers x0 = hn::Set(tag, 1.1F), x1 = hn::Set(tag, 1.2F), x2 = hn::Set(tag, 1.3F);
  Numbers x3 = hn::Set(tag, 1.4F), x4 = hn::Set(tag, 1.5F), x5 = hn::Set(tag, 1.6F);
  Numbers x6 = hn::Set(tag, 1.7F), x7 = hn::Set(tag, 1.8F), x8 = hn::Set(tag, 1.9F);
  Numbers x9 = hn::Set(tag, 2.1F), x10 = hn::Set(tag, 2.2F), x11 = hn::Set(tag, 2.3F);
  for (size_t round = 0; round < rounds; ++round) {
    x0 = step(x0), x1 = step(x1), x2 = step(x2), x3 = step(x3);
    x4 = step(x4), x5 = step(x5), x6 = step(x6), x7 = step(x7);
    x8 = step(x8), x9 = step(x9), x10 = step(x10), x11 = step(x11);
  }
  x0 = hn::Add(hn::Add(hn::Add(x0, x1), hn::Add(x2, x3)), hn::Add(hn::Add(x4, x5), x6));
  x7 = hn::Add(hn::Add(x7, x8), hn::Add(hn::Add(x9, x10), x11));
  hn::Store(hn::Add(x0, x7), tag, out);
  MustBeDone(out);
}

// The number of units that the rate counts.
double Run(CpuOperation operation, const float* from, float* to, size_t count, size_t rounds) {
  const Tag tag;
  const double numbers =
      static_cast<double>(rounds) * static_cast<double>(kChains * hn::Lanes(tag));
  const Numbers a = hn::Set(tag, 0.999F), b = hn::Set(tag, 0.001F);
  switch (operation) {
    case CpuOperation::kCopy:
      Copy(from, to, count, rounds);
      return 2.0 * sizeof(float) * static_cast<double>(count) * static_cast<double>(rounds);
    case CpuOperation::kMultiplyAdd:
      Repeat(rounds, to, [&](Numbers x) HWY_ATTR { return hn::Add(hn::Mul(x, a), b); });
      return 2 * numbers;
    case CpuOperation::kFusedMultiplyAdd:
      Repeat(rounds, to, [&](Numbers x) HWY_ATTR { return hn::MulAdd(x, a, b); });
      return 2 * numbers;
    case CpuOperation::kDivide:
      Repeat(rounds, to, [&](Numbers x) HWY_ATTR { return hn::Div(a, x); });
      return numbers;
    case CpuOperation::kSquareRoot:
      Repeat(rounds, to, [&](Numbers x) HWY_ATTR { return hn::Sqrt(x); });
      return numbers;
  }
  return 0;
}

size_t LaneCount() {
  return hn::Lanes(Tag());
}
int64_t Target() {
  return HWY_TARGET;
}

}  // namespace
}  // namespace drape::bench::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include <algorithm>
#include <barrier>
#include <chrono>
#include <thread>
#include <vector>

#include "hwy/aligned_allocator.h"

namespace drape::bench {
namespace {

HWY_EXPORT(Run);
HWY_EXPORT(LaneCount);
HWY_EXPORT(Target);

using Clock = std::chrono::steady_clock;

// One thread's buffers and how often it repeats a round.
class Runner {
 public:
  explicit Runner(const CpuRun& run)
      : run_(run),
        count_(std::max<size_t>(run.buffer_bytes / 2 / sizeof(float) / kBlock * kBlock, kBlock)),
        from_(hwy::AllocateAligned<float>(count_)),
        to_(hwy::AllocateAligned<float>(count_)) {
    std::fill_n(from_.get(), count_, 1.0F);
    std::fill_n(to_.get(), count_, 0.0F);
    for (;;) {
      const double took_s = Time_s();
      if (took_s > run.seconds / 8) {
        rounds_ = std::max<size_t>(
            1, static_cast<size_t>(static_cast<double>(rounds_) * run.seconds / took_s));
        return;
      }
      rounds_ *= 2;
    }
  }
  // The rate of a run.
  double Rate() {
    const double took_s = Time_s();
    return amount_ / took_s;
  }

 private:
  static constexpr size_t kBlock = 64;  // floats, a multiple of any number of lanes

  double Time_s() {
    const auto start = Clock::now();
    amount_ = HWY_DYNAMIC_DISPATCH(Run)(run_.operation, from_.get(), to_.get(), count_, rounds_);
    return std::chrono::duration<double>(Clock::now() - start).count();
  }

  const CpuRun run_;
  const size_t count_;
  hwy::AlignedFreeUniquePtr<float[]> from_, to_;
  size_t rounds_ = 1;
  double amount_ = 0;
};

}  // namespace

double MeasureCpuRate(const CpuRun& run) {
  constexpr int kRepeats = 3;
  std::barrier together(static_cast<std::ptrdiff_t>(run.threads));
  std::vector<std::vector<double>> rates(run.threads);  // [thread][repeat]
  std::vector<std::thread> threads;
  for (uint32_t k = 0; k < run.threads; ++k) {
    threads.emplace_back([&, k] {
      Runner runner(run);
      for (int repeat = 0; repeat < kRepeats; ++repeat) {
        together.arrive_and_wait();
        rates[k].push_back(runner.Rate());
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  double best = 0;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    double sum = 0;
    for (const std::vector<double>& of_thread : rates) sum += of_thread[repeat];
    best = std::max(best, sum);
  }
  return best;
}

std::string CpuLanesName() {
  return std::string(hwy::TargetName(HWY_DYNAMIC_DISPATCH(Target)())) + ", " +
         std::to_string(HWY_DYNAMIC_DISPATCH(LaneCount)()) + " lanes";
}

}  // namespace drape::bench

#endif  // HWY_ONCE
