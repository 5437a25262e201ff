#pragma once

/// The package's messages and services. Include these here and nowhere else: the generated headers give the message
/// `tissue_sim/Contact` the C++ name of the core's `tissue_sim::Contact`, so it is called ContactMessage in C++.
#define Contact ContactMessage
#include <tissue_sim/Contact.h>
#include <tissue_sim/Contacts.h>
#undef Contact
#include <tissue_sim/GetTopology.h>
#include <tissue_sim/ResetOrgan.h>
#include <tissue_sim/TissueState.h>
#include <tissue_sim/TissueTopology.h>
