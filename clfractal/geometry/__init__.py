"""What a scene has beside its formula, as kernels read it: objects, joined solids, planes, water."""
