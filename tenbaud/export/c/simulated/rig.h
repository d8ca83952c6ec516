/* A rig that is not there: the codec's model as the plant, and a line of text about the node. */
#ifndef TENBAUD_RIG_H
#define TENBAUD_RIG_H

#include "../node.h"

/* Begin at the model's initial state, now. The encoders and motors of hardware.h are in rig.c. */
void rig_begin(void);

/* Writes the node's counts as a line of JSON, character by character. */
void rig_report(const node *own, void (*put)(char));
void rig_report_number(const char *name, uint32_t number, void (*put)(char));

#endif
