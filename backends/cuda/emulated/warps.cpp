// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "block.hpp"

// Operations of the threads of a warp.

namespace gsnav::emulated {

void Block::refuse_mask(unsigned mask, const char* what) const {
  if ((mask & bit()) == 0) fail(std::string(what) + " with a mask that it is not of");
  if ((mask & ~warp().there) != 0) fail(std::string(what) + " waits for threads that the block has not");
  fail(std::string(what) + " waits for thread " +
       std::to_string(current_ / kWarp * kWarp + first_of(mask & warp().done)) + ", which has ended");
}

void Block::check_mask(unsigned mask, const char* what) const {
  const Warp& w = warp();
  if ((mask & bit()) == 0 || (mask & (~w.there | w.done)) != 0) refuse_mask(mask, what);
}

Gathered& Block::gather(unsigned mask, std::uint64_t value, const char* what) {
  Warp& w = warp();
  in_vain_ = 0;
  check_mask(mask, what);
  Thread* const lanes = &threads_[current_ / kWarp * kWarp];
  Thread& t = self();
  t.mask = mask;
  t.value = value;
  t.what = what;
  w.at_warp |= bit();
  bool complete = (mask & w.at_warp) == mask;
  for (unsigned left = complete ? mask : 0; left != 0; left &= left - 1) {
    const Thread& other = lanes[first_of(left)];
    complete = complete && other.mask == mask && other.what == what;
  }
  if (!complete) {
    leave();
    return *t.gathered;
  }
  Gathered* g = w.gathered;
  while (g != w.gathered + kWarp && g->readers != 0) ++g;
  if (g == w.gathered + kWarp) fail("more operations of a warp at once than it has threads");
  g->not_zero = 0;
  for (unsigned left = mask; left != 0; left &= left - 1) {
    const unsigned lane = first_of(left);
    Thread& other = lanes[lane];
    g->value[lane] = other.value;
    g->not_zero |= (other.value != 0 ? 1u : 0u) << lane;
    other.gathered = g;
    ++g->readers;
  }
  w.at_warp &= ~mask;
  w.ready |= mask & ~bit();
  return *g;
}

GSNAV_UNCHECKED void sync_warp(unsigned mask, const char* what) {
  --block().gather(mask, 0, what).readers;
}
GSNAV_UNCHECKED std::uint64_t value_of_thread(unsigned mask, std::uint64_t value, unsigned from,
                                              const char* what) {
  Gathered& all = block().gather(mask, value, what);
  --all.readers;
  return (mask >> from & 1u) != 0 ? all.value[from] : 0xdeadbeefdeadbeefull;
}
GSNAV_UNCHECKED unsigned threads_that_have_any(unsigned mask, std::uint64_t value, const char* what) {
  Gathered& all = block().gather(mask, value, what);
  --all.readers;
  return all.not_zero;
}
GSNAV_UNCHECKED unsigned threads_that_have_same(unsigned mask, std::uint64_t value, const char* what) {
  Gathered& all = block().gather(mask, value, what);
  --all.readers;
  unsigned same = 0;
  for (unsigned left = mask; left != 0; left &= left - 1) {
    same |= (all.value[first_of(left)] == value ? 1u : 0u) << first_of(left);
  }
  return same;
}

}  // namespace gsnav::emulated
