// SPDX-License-Identifier: Apache-2.0
#include "fiber.hpp"

#include <sys/mman.h>
#include <unistd.h>

#if defined(__SANITIZE_ADDRESS__)
#define GSNAV_ASAN 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define GSNAV_ASAN 1
#endif
#endif
#if defined(GSNAV_ASAN)
#include <pthread.h>
#include <sanitizer/common_interface_defs.h>
#endif

namespace gsnav::emulated {

// void gsnav_emulated_switch(void** from, void* to): saves the registers that a call preserves (System V
// ABI) on the stack, stores the stack pointer in *from, and continues where `to` was left.
extern "C" void gsnav_emulated_switch(void** from, void* to);
asm(R"(
.text
.globl gsnav_emulated_switch
.hidden gsnav_emulated_switch
.type gsnav_emulated_switch, @function
gsnav_emulated_switch:
  pushq %rbp
  pushq %rbx
  pushq %r12
  pushq %r13
  pushq %r14
  pushq %r15
  movq %rsp, (%rdi)
  movq %rsi, %rsp
  popq %r15
  popq %r14
  popq %r13
  popq %r12
  popq %rbx
  popq %rbp
  ret
.size gsnav_emulated_switch, .-gsnav_emulated_switch
)");

namespace {

constexpr std::size_t kStackBytes = 256 << 10;
constexpr int kSavedRegisters = 6;

}  // namespace

Fiber Fiber::of_this_thread() {
  Fiber fiber;
#if defined(GSNAV_ASAN)
  pthread_attr_t attributes;
  void* stack = nullptr;
  pthread_getattr_np(pthread_self(), &attributes);
  pthread_attr_getstack(&attributes, &stack, &fiber.bytes_);
  pthread_attr_destroy(&attributes);
  fiber.stack_ = stack;
#endif
  return fiber;
}

bool Fiber::start(void (*main)()) {
  if (stack_ != nullptr) return true;
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  void* const memory = mmap(nullptr, kStackBytes + page, PROT_READ | PROT_WRITE,
                            MAP_PRIVATE | MAP_ANONYMOUS | MAP_STACK, -1, 0);
  // The lowest page is inaccessible, so that a stack overflow faults.
  if (memory == MAP_FAILED || mprotect(memory, page, PROT_NONE) != 0) return false;
  char* const stack = static_cast<char*>(memory) + page;
  stack_ = stack;
  bytes_ = kStackBytes;
  // As after a call of main(): the unused return address lies 8 bytes below a multiple of 16.
  auto** top = reinterpret_cast<void**>(stack + kStackBytes) - 1;
  *top = nullptr;
  *--top = reinterpret_cast<void*>(main);
  for (int i = 0; i < kSavedRegisters; ++i) *--top = nullptr;
  sp_ = top;
  return true;
}

void Fiber::began() {
#if defined(GSNAV_ASAN)
  __sanitizer_finish_switch_fiber(nullptr, nullptr, nullptr);
#endif
}

GSNAV_UNCHECKED void Fiber::change(Fiber& from, Fiber& to) {
#if defined(GSNAV_ASAN)
  __sanitizer_start_switch_fiber(&from.fake_stack_, to.stack_, to.bytes_);
#endif
  gsnav_emulated_switch(&from.sp_, to.sp_);
#if defined(GSNAV_ASAN)
  __sanitizer_finish_switch_fiber(from.fake_stack_, nullptr, nullptr);
#endif
}

}  // namespace gsnav::emulated
