// What Adam knows of its gradients, carried from one leg to the next in little room: of every parameter's second
// moments the means over rows and over columns, from which their product gives them back (Shazeer and Stern 2018,
// Adafactor). Without them a leg spends its first hundreds of steps finding its way back to where it began.
#pragma once
#include <cstdint>
#include <map>
#include <string>

#include "host/graph/plan.hpp"
#include "host/io/safetensors.hpp"

namespace clerestory {

struct Moments {
  std::int64_t steps = 0;                       // of all legs that they come from; 0: there are none
  std::map<std::string, StoredTensor> tensors;  // "moments.rows.<parameter>" and "moments.columns.<parameter>": ln
};

/// Of every parameter that the states hold moments of ("adam.v.<parameter>").
Moments factored_moments(const States& states, std::int64_t steps);

/// Sets adam.v of all parameters if the factors of all are there, else of none and returns false: one step count
/// corrects the bias of all. First moments stay 0, which is a short warm-up. Throws usage_error naming `where` and the
/// tensor when factors do not fit their parameter.
bool set_moments(States& states, const Moments& moments, const std::string& where);

/// Of parameters that the states hold no moments of, since this leg does not train them: kept for the next one.
Moments moments_of_others(const Moments& moments, const States& states);

/// Both in one, of a parameter that both have those of `first`. One step count corrects the bias of all: the smaller
/// one, by which no moment is thought less than it is.
Moments joined(Moments first, const Moments& more);

/// Into a file of weights: of parameters whose names begin with `prefix`.
void store_moments(TensorFile& file, const Moments& moments, const std::string& prefix = {});
/// What a file holds, of a checkpoint the factors of what it has whole as well; none where it holds none.
Moments stored_moments(const TensorFile& file, const std::string& where);
/// Of a checkpoint: what moments_of_others() kept.
Moments kept_moments(const TensorFile& file, const std::string& where);

/// Of a checkpoint: steps of the legs before it that its second moments come from; 0 in those of before there were any.
inline constexpr const char* kEarlierSteps = "earlier_moment_steps";  // its key
std::int64_t earlier_moment_steps(const TensorFile& file, const std::string& where);

}  // namespace clerestory
