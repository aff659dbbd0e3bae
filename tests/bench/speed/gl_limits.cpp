#include "tests/bench/speed/gl_limits.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <string>

#include "server/gl/buffer.h"
#include "server/gl/context.h"
#include "server/gl/program.h"

namespace drape::bench {
namespace {

// Work groups of 256; a constant that the shaders repeat.
constexpr uint32_t kGroup = 256;

// One vec4 per invocation.
constexpr char kCopy[] = R"(#version 450
layout(local_size_x = 256) in;
layout(std430, binding = 0) readonly buffer From { vec4 from[]; };
layout(std430, binding = 1) writeonly buffer To { vec4 to[]; };
void main() { to[gl_GlobalInvocationID.x] = from[gl_GlobalInvocationID.x]; }
)";

// Four independent chains of four numbers, 256 rounds: 8192 operations of each invocation.
constexpr double kFlopsPerInvocation = 256 * 4 * 4 * 2;
constexpr char kMultiplyAdd[] = R"(#version 450
layout(local_size_x = 256) in;
layout(std430, binding = 0) readonly buffer From { vec4 from[]; };
layout(std430, binding = 1) writeonly buffer To { vec4 to[]; };
void main() {
  vec4 a = from[gl_LocalInvocationID.x] * 0.5, b = a + 0.1, c = a + 0.2, d = a + 0.3;
  vec4 scale = vec4(0.999), offset = vec4(0.001);
  for (int k = 0; k < 256; ++k) {
    a = fma(a, scale, offset);
    b = fma(b, scale, offset);
    c = fma(c, scale, offset);
    d = fma(d, scale, offset);
  }
  to[gl_GlobalInvocationID.x] = a + b + c + d;
}
)";

// Each round an invocation reads a number that another one wrote and writes its own: 8 bytes, as a
// phase of the resident plan does, with the barrier between the phases.
constexpr double kSharedBytesPerInvocation = 256 * 8;
constexpr char kShared[] = R"(#version 450
layout(local_size_x = 256) in;
layout(std430, binding = 1) writeonly buffer To { float to[]; };
shared float values[2 * 256];
void main() {
  uint i = gl_LocalInvocationID.x;
  values[i] = float(i);
  barrier();
  for (uint k = 0u; k < 256u; ++k) {
    uint from = 256u * (k & 1u), into = 256u - from;
    values[into + i] = values[from + ((i + 1u) & 255u)] + 1.0;
    memoryBarrierShared();
    barrier();
  }
  to[gl_GlobalInvocationID.x] = values[i];
}
)";

// A group of 64 that does nothing but add one number after the other, with so many words of shared
// memory.
std::string Waiting(uint32_t words) {
  return R"(#version 450
layout(local_size_x = 64) in;
layout(std430, binding = 1) writeonly buffer To { float to[]; };
shared float values[)" +
         std::to_string(words) + R"(];
void main() {
  uint i = gl_LocalInvocationID.x;
  float a = float(i);
  values[i] = a;
  barrier();
  for (uint k = 0u; k < 20000u; ++k) a = a * 0.5 + 1.0;
  values[(i * 7u) % )" +
         std::to_string(words) + R"(u] = a;
  barrier();
  to[i] = values[i];
}
)";
}

template <class Value>
Value Must(Result<Value> result) {
  if (!result.ok()) throw std::runtime_error("limits of gl: " + result.status().ToString());
  return std::move(result).value();
}

gl::Program Compile(const char* name, const char* text) {
  return Must(gl::Program::Compile({.name = name, .text = text, .lines = {}}));
}

// Seconds of one dispatch: as many together as take `seconds`, the best of three times.
double TimeDispatch_s(const gl::Program& program, uint32_t groups, double seconds) {
  const auto time_s = [&](int count) {
    glFinish();
    const auto start = std::chrono::steady_clock::now();
    for (int k = 0; k < count; ++k) {
      glDispatchCompute(groups, 1, 1);
      glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    }
    glFinish();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  program.Use();
  time_s(1);  // compiles
  int count = 1;
  double best_s = time_s(count);
  while (best_s < seconds) best_s = time_s(count *= 2);
  for (int repeat = 0; repeat < 2; ++repeat) best_s = std::min(best_s, time_s(count));
  return best_s / count;
}

// Groups that run at the same time, by their shared memory: what a resident cloth shares a
// multiprocessor with.
void AddGroupsAtOnce(const gl::Context& context, double seconds, GlLimits& limits) {
  constexpr uint32_t kGroups = 8192;
  for (const uint32_t kibibytes : {2u, 8u, 12u, 16u, 24u, 32u, 48u}) {
    if (static_cast<int64_t>(kibibytes) * 1024 > context.limits().shared_memory_bytes) continue;
    const std::string text = Waiting(kibibytes * 1024 / sizeof(float));
    const gl::Program waiting = Compile("waiting", text.c_str());
    const double one_s = TimeDispatch_s(waiting, 1, seconds);
    const double all_s = TimeDispatch_s(waiting, kGroups, seconds);
    limits.rates.push_back(
        {"work groups at once, each with " + std::to_string(kibibytes) + " KiB of shared memory", 0,
         kGroups * one_s / all_s, "group"});
  }
}

}  // namespace

GlLimits MeasureGlLimits(double seconds, bool quick) {
  const std::unique_ptr<gl::Context> context = Must(gl::Context::Create({}));
  GlLimits limits{context->renderer(), {}};
  // Beyond the caches: 256 MiB each on a GPU, what a core of a software device copies in some ms.
  const size_t mebibytes = quick ? 1 : context->is_software() ? 64 : 256;
  const size_t bytes = mebibytes << 20;
  const gl::Buffer from = Must(gl::Buffer::Create(bytes));
  const gl::Buffer to = Must(gl::Buffer::Create(bytes));
  glClearNamedBufferData(from.name(), GL_R32F, GL_RED, GL_FLOAT, nullptr);
  from.BindStorage(0);
  to.BindStorage(1);
  const auto copy_groups = static_cast<uint32_t>(bytes / sizeof(float[4]) / kGroup);
  const double copy_s = TimeDispatch_s(Compile("copy", kCopy), copy_groups, seconds);
  limits.rates.push_back(
      {"copy", 2.0 * static_cast<double>(bytes), 2 * static_cast<double>(bytes) / copy_s, "byte"});
  // Many groups per core of a GPU; few are enough to keep the threads of a software device busy.
  const uint32_t groups = std::min(copy_groups, context->is_software() ? 64U : 16384U);
  const double invocations = double{1} * groups * kGroup;
  const double fma_s = TimeDispatch_s(Compile("fma", kMultiplyAdd), groups, seconds);
  limits.rates.push_back(
      {"fused multiply-add", 0, invocations * kFlopsPerInvocation / fma_s, "flop"});
  const double shared_s = TimeDispatch_s(Compile("shared", kShared), groups, seconds);
  limits.rates.push_back(
      {"shared memory", 0, invocations * kSharedBytesPerInvocation / shared_s, "byte"});
  // On a software device the answer is its threads.
  if (!context->is_software()) AddGroupsAtOnce(*context, seconds, limits);
  return limits;
}

}  // namespace drape::bench
