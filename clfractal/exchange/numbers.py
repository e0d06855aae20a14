"""The numbers by which settings files name formulas, and the files that the program reads for them."""

from __future__ import annotations

from collections.abc import Mapping

# Observed: which file Mandelbulber 2.20 opens for a number.
_WORDS = """
2 mandelbulb 3 mandelbulb_power2 4 hypercomplex 5 quaternion 7 menger_sponge 8 mandelbox 10 kaleidoscopic_ifs 11
xenodreambuie 13 mandelbulb2 14 mandelbulb3 15 mandelbulb4 16 box_fold_bulb_pow2 17 mandelbox_smooth 18
mandelbox_vary_scale4d 19 aexion 20 benesi 21 bristorbrot 37 generalized_fold_box 39 ides 40 ides2 41 buffalo 48
quick_dudley 49 lkmitch 50 makin3d2 51 msltoe_sym2_mod 56 transf_platonic_solid 59 fold_box_mod1 60 abox_mod_kali
61 menger_mod1 62 quaternion3d 63 aexion_octopus_mod 64 abox_mod1 65 mandelbulb_multi 66 benesi_pine_tree 67
benesi_t1_pine_tree 68 msltoe_sym3_mod 69 msltoe_sym4_mod 70 eiffie_msltoe 71 riemann_sphere_msltoe_v1 72
riemann_sphere_msltoe 73 amazing_surf 74 kalisets1 75 abox_mod2 76 abox_vs_icen1 77 amazing_surf_mod1 78
mandelbulb_vary_power_v1 79 quaternion4d 80 msltoe_sym3_mod2 81 msltoe_sym3_mod3 82 msltoe_donut 83 iq_bulb 84
quick_dudley_mod 85 riemann_bulb_msltoe_mod2 86 msltoe_toroidal 87 abox_mod_kali_eiffie 88 collatz 89 collatz_mod
90 menger_pwr2_poly 91 mandelbox_menger 92 mandelbulb_kali 93 mandelbulb_kali_multi 94 mandelbulb_bermarte 95
menger_middle_mod 96 msltoe_toroidal_multi 97 amazing_surf_multi 98 menger_cross_kifs 99 menger_prism_shape 100
benesi_mag_transforms 101 pseudo_kleinian_std_de 102 bristorbrot4d 103 pseudo_kleinian 104 pseudo_kleinian_mod1
105 benesi_pwr2_mandelbulb 106 menger_cross_mod1 107 menger_prism_shape2 108 mix_pinski4d 109 sierpinski4d 110
sierpinski3d 111 menger4d 112 menger4d_mod1 113 menger_smooth 114 menger_smooth_mod1 115 menger_octo 116 abox4d
117 pseudo_kleinian_mod2 118 mandelbulb_multi2 119 abox_mod11 120 mandelbulb_quat 121 mandelbulb_juliabulb 122
jos_kleinian 123 abox_mod12 124 quaternion_cubic4d 125 box_fold_bulb_pow2_v2 126 box_fold_bulb_pow2_v3 127
abox_mod13 128 box_fold_quat 129 coastalbrot 130 modulus_menger_sponge 131 modulus_mandelbulb 132
amazing_surf_mod2 133 mandelbox_variable 134 box_fold4d_bulb_pow2 135 abox_mod_kali_v2 136 abox_mod_kali_v3 137
mandelbulb_abs_power2 138 mandelbulb_pow2_v2 139 riemann_sphere_msltoe_v2 140 abox_surf_box 141
box_fold_bulb_menger 142 vicsek 143 jos_kleinian_v2 144 mandelbulb_atan2_power2 145 bristorbrot2 146 mandeltorus
147 amazing_surf_mod3 148 mandelbulb_power1234 149 menger_poly_fold 150 ifs_xy 152 scator_power2_imaginary 156
scator_power2_real 173 scator_power2 174 scator_power2_std_r 180 riemann_sphere_hobold_pow4 181
riemann_sphere_hobold_pow8 182 mandelbulb_kosalos 183 mandelbulb_kosalos_v2 184 riemann_sphere_hobold_multi 185
mandelbulb_lambda 600 difs_box_diagonal_v1 601 difs_box_v1 602 difs_box_diagonal_v3 603 difs_cylinder 604
difs_sphere 605 difs_ellipsoid 606 difs_torus 607 difs_menger 608 difs_hextgrid2 609 difs_prism 610
difs_msltoe_donut 800 mandelbulb_eye 1001 transf_add_constant 1002 transf_rotation 1003 transf_scale 1004
transf_scale3d 1005 transf_box_offset 1006 transf_spherical_offset 1007 transf_add_cpixel 1008
transf_add_cpixel_axis_swap 1009 transf_benesi_t1 1010 transf_benesi_t1_mod 1011 transf_benesi_t2 1012
transf_benesi_t3 1013 transf_benesi_t4 1014 transf_benesi_t5b 1015 transf_benesi_mag_forward 1016
transf_benesi_mag_backward 1017 transf_benesi_cube_sphere 1018 transf_benesi_sphere_cube 1019
transf_add_cpixel_symmetrical 1020 transf_box_fold 1021 transf_spherical_fold 1022 transf_zvector_axis_swap 1023
transf_abs_add_constant 1024 transf_neg_abs_add_constant 1025 transf_abs_add_tglad_fold 1026 transf_multiple_angle
1027 transf_r_power 1028 transf_iteration_weight 1029 transf_abs_add_multi 1030 transf_spherical_pwr_fold 1031
transf_add_cpixel_vary_v1 1032 transf_scale_vary_v1 1033 transf_add_constant_vary_v1 1034 transf_box_fold_xyz 1035
transf_add_cpixel_cx_cy_axis_swap 1036 transf_rotation_vary_v1 1037 transf_lin_combine_cxyz 1038
transf_spherical_inv_c 1039 transf_add_constant4d 1040 transf_box_fold4d 1041 transf_iteration_weight4d 1042
transf_spherical_fold4d 1043 transf_scale4d 1044 transf_abs_add_constant4d 1045 transf_abs_add_tglad_fold4d 1047
transf_pwr2_polynomial 1048 transf_rotation_folding_plane 1049 transf_spherical_fold_abox 1050
transf_spherical_fold_vary_v1 1051 transf_quaternion_fold 1052 transf_menger_fold 1053 transf_inv_cylindrical 1054
transf_rpow3 1055 transf_spherical_inv 1056 transf_folding_tetra3d 1057 transf_box_fold_vary_v1 1058
transf_surf_box_fold 1059 transf_octo_fold 1060 transf_scale_vary_vcl 1061 transf_spherical_fold_vary_vcl 1062
transf_add_exp2_z 1063 transf_reciprocal3 1064 transf_rotation_folding 1065 transf_abs_add_conditional 1066
transf_reciprocal4d 1067 transf_abs_add_conditional4d 1068 transf_spherical_offset_vcl 1069 transf_rotation4d 1070
transf_parab_fold 1071 transf_scale_vary_v212 1072 transf_spherical_fold_chs 1073 transf_spherical_fold_parab 1074
transf_scale_vary_multi 1076 transf_spherical_fold_cuboid 1077 transf_spherical_fold_xyz_bias 1078
transf_add_cpixel_rotated 1079 transf_add_constant_mod1 1080 transf_poly_fold_sym_xy 1081
transf_poly_fold_sym_multi 1082 transf_sin_or_cos 1083 transf_sin_and_cos 1084 transf_sin_and_cos_max 1085
transf_blockify 1086 transf_add_cpixel_scator 1087 transf_add_cpixel_sin_or_cos 1088 transf_surf_box_fold_v2 1089
transf_box_wrap4d 1090 transf_spherical_inv_v2 1091 transf_rotation_iter_controls 1092 transf_clamp4d 1093
transf_abs_add_multi4d 1094 transf_rotate_about_vec3 1095 transf_offset_s_curve4d 1096 transf_gnarl 1097
transf_box_tiling4d 1098 transf_diagonal_fold 1099 transf_poly_fold_atan 1100 transf_poly_fold_atan2 1101
transf_abs_add_conditional2 1102 transf_add_constant_mod2 1103 transf_add_constant_rot_v1 1104
transf_surf_box_fold_v24d 1105 transf_scale_offset 1601 transf_difs_cylinder 1602 transf_difs_ellipsoid 1603
transf_difs_hextgrid2 1604 transf_difs_sphere 1605 transf_difs_torus 1606 transf_difs_prism 1607
transf_difs_box_v2 1608 transf_difs_cylinder_v2 1609 transf_difs_box_v3 1610 transf_difs_torus_v2 1611
transf_difs_torus_v3 1612 transf_difs_prism_v2 1613 transf_difs_grid 1614 transf_difs_grid_v2 2000
transf_hybrid_color 2001 transf_hybrid_color2 2002 transf_difs_hybrid_color 2100 testing 2101 testing4d 2102
testing_log 2103 testing_log 2104 testing_transform
""".split()  # noqa: SIM905
NAMES: Mapping[int, str] = {int(number): name for number, name in zip(_WORDS[::2], _WORDS[1::2], strict=True)}
"""Of formulas up to version 2.20; those that came later are known by the settings of their pictures."""
